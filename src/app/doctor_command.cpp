#include <iostream>

#include "sovo/app/commands.h"
#include "sovo/app/doctor.h"
#include "sovo/app/exit_codes.h"

namespace sovo::app {
namespace {

int examine() {
  bool good = true;
  for (const Finding& finding : examine_machine()) {
    good &= finding.good;
    std::cout << (finding.good ? "ok:   " : "MEND: ") << finding.text << "\n";
    if (!finding.mend.empty()) std::cout << "      " << finding.mend << "\n";
  }
  return good ? kOk : kFailed;
}

}  // namespace

void add_doctor_command(const Command& program) {
  program
      .add_command("doctor",
                   "Look at this machine's settings for cameras and large messages, and print the "
                   "line that mends each; exit code 1 when something is to be mended")
      .action(examine);
}

}  // namespace sovo::app
