#pragma once

#include <cstring>
#include <deque>
#include <string>
#include <type_traits>
#include <vector>

#include "message_traits.h"
#include "sovo/bridge/borrow.h"
#include "sovo/bridge/message_kinds.h"

namespace sovo::bridge {

/// Fills every field of a message with a value of its own and keeps what the message borrows.
class MessageFiller {
 public:
  template <class T>
  void fill(T& value) {
    if constexpr (IsMessage<T>) {
      MessageTraits<T>::visit(value, [&](const char*, auto& field) { fill(field); });
    } else if constexpr (IsSequence<T>) {
      fill_sequence(value);
    } else if constexpr (std::is_array_v<T>) {
      fill_array(value);
    } else if constexpr (std::is_same_v<T, char*>) {
      texts_.push_back("text " + std::to_string(++count_));
      value = texts_.back().data();
    } else if constexpr (std::is_same_v<T, bool>) {
      value = ++count_ % 2 == 0;
    } else {
      value = static_cast<T>(++count_);
    }
  }

 private:
  template <class T, std::size_t N>
  void fill_array(T (&values)[N]) {
    if constexpr (std::is_same_v<T, char>) {
      std::strncpy(values, "bounded text", N);
    } else {
      for (T& value : values) fill(value);
    }
  }

  template <class Sequence>
  void fill_sequence(Sequence& sequence) {
    using T = std::remove_pointer_t<decltype(sequence._buffer)>;
    sequence._length = sequence._maximum = 3;
    sequence._release = false;
    memory_.emplace_back(3 * sizeof(T) / sizeof(std::max_align_t) + 1);
    sequence._buffer = reinterpret_cast<T*>(memory_.back().data());
    for (int i = 0; i < 3; ++i) fill(sequence._buffer[i]);
  }

  int count_ = 0;
  std::deque<std::string> texts_;
  std::deque<std::vector<std::max_align_t>> memory_;
};

/// Whether all fields are equal, and where not.
template <class T>
bool equal(const T& a, const T& b) {
  if constexpr (IsMessage<T>) {
    std::vector<const void*> fields;
    MessageTraits<T>::visit(b, [&](const char*, const auto& field) { fields.push_back(&field); });
    bool same = true;
    std::size_t i = 0;
    MessageTraits<T>::visit(a, [&](const char*, const auto& field) {
      using Field = std::remove_cvref_t<decltype(field)>;
      same = equal(field, *static_cast<const Field*>(fields[i++])) && same;
    });
    return same;
  } else if constexpr (IsSequence<T>) {
    if (a._length != b._length) return false;
    for (std::uint32_t i = 0; i < a._length; ++i) {
      if (!equal(a._buffer[i], b._buffer[i])) return false;
    }
    return true;
  } else if constexpr (std::is_array_v<T>) {
    for (std::size_t i = 0; i < std::extent_v<T>; ++i) {
      if (!equal(a[i], b[i])) return false;
    }
    return true;
  } else if constexpr (std::is_same_v<T, char*>) {
    return std::strcmp(a, b) == 0;
  } else {
    return a == b;
  }
}

}  // namespace sovo::bridge
