#include "sovo/app/stop_signal.h"

#include <csignal>
#include <ctime>

namespace sovo::app {
namespace {

sigset_t stop_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

StopSignal::StopSignal() {
  const sigset_t set = stop_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

bool StopSignal::requested() {
  if (requested_) return true;
  const sigset_t set = stop_signals();
  const timespec no_wait{};
  requested_ = sigtimedwait(&set, nullptr, &no_wait) > 0;
  // From here on the default action stands again, so that an impatient second signal works.
  if (requested_) pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
  return requested_;
}

}  // namespace sovo::app
