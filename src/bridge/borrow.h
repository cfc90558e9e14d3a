#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sovo::bridge {

// Messages that are written borrow the memory of the core's types: Cyclone DDS only reads them
// while it serializes, so that nothing is copied twice. A borrowing message must not be freed, and
// lives no longer than what it borrows from.

/// Lets a sequence of a message show `values`.
template <class Sequence, class T>
void borrow(Sequence& sequence, const std::vector<T>& values) {
  sequence._buffer = const_cast<T*>(values.data());
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(values.size());
  sequence._release = false;
}

inline char* borrow(const std::string& text) { return const_cast<char*>(text.c_str()); }
inline char* borrow(const char* text) { return const_cast<char*>(text); }

/// Text of a received message; missing is empty.
inline const char* text_or_empty(const char* text) { return text == nullptr ? "" : text; }

}  // namespace sovo::bridge
