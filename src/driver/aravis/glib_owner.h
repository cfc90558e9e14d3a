#pragma once

#include <arv.h>

#include <memory>
#include <string>

namespace sovo::aravis {

struct ObjectDeleter {
  void operator()(gpointer object) const { g_object_unref(object); }
};
/// A reference to an object of GLib's, given up with the pointer.
template <class T>
using Owned = std::unique_ptr<T, ObjectDeleter>;

struct MemoryDeleter {
  void operator()(gpointer memory) const { g_free(memory); }
};

/// An error as GLib hands it out, freed with this object.
class Problem {
 public:
  Problem() = default;
  ~Problem() { g_clear_error(&error_); }
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;

  /// Where the next call shall put its error; forgets the one before.
  GError** slot() {
    g_clear_error(&error_);
    return &error_;
  }
  explicit operator bool() const { return error_ != nullptr; }
  std::string text() const { return error_ == nullptr ? "no reason given" : error_->message; }

 private:
  GError* error_ = nullptr;
};

inline std::string to_text(const char* text) { return text == nullptr ? "" : text; }

}  // namespace sovo::aravis
