#pragma once

namespace sovo::app {

/// Turns SIGINT and SIGTERM into a question that the work asks now and then. Make it before any
/// thread is started: the signals are blocked for the threads that come later.
///
/// The first signal asks for a clean end; a second one ends the process at once.
class StopSignal {
 public:
  StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  /// Whether the user wants an end. Call from the thread that made the object.
  bool requested();

 private:
  bool requested_ = false;
};

}  // namespace sovo::app
