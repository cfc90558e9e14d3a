#include "sovo/app/process_memory.h"

#include <fstream>
#include <string>

namespace sovo::app {

double peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word) {
    if (word != "VmHWM:") continue;
    double kibibytes = 0.0;
    status >> kibibytes;
    return kibibytes * 1024.0 / 1e6;
  }
  return 0.0;
}

}  // namespace sovo::app
