#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "sovo/app/commands.h"
#include "sovo/app/failure.h"
#include "sovo/io/mcap_recovery.h"
#include "sovo/io/recording.h"
#include "sovo/io/recording_writer.h"

namespace sovo::app {
namespace {

int recover(const std::string& path) {
  const auto files = recording_files(path);
  if (!files) return fail(kBadInput, files.error());
  for (const std::string& file : *files) {
    const auto recovery = recover_mcap(file);
    if (!recovery) return fail(kBadInput, recovery.error());
    for (const std::string& note : recovery->notes) spdlog::warn("{}", note);
    std::cout << file << ": " << recovery->messages << " messages, "
              << (recovery->was_whole ? "nothing to mend"
                                      : "mended; the damaged file is " + file + ".cut")
              << "\n";
  }
  if (!std::filesystem::is_directory(path)) return kOk;
  const auto written = write_bag_metadata(path);
  return written ? kOk : fail(kFailed, written.error());
}

}  // namespace

void add_recover_command(const Command& program) {
  const Command command =
      program.add_command("recover", "Mend a recording that was cut or damaged");
  auto path = std::make_shared<std::string>();
  command.option("recording", "Folder or .mcap file", path.get()).required().type("DIR|FILE");
  command.action([path] { return recover(*path); });
}

}  // namespace sovo::app
