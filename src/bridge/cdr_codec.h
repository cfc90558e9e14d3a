#pragma once

#include <cstddef>
#include <cstring>
#include <deque>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "message_traits.h"
#include "sovo/bridge/cdr_sertype.h"
#include "sovo/bridge/message_kinds.h"
#include "sovo/io/result.h"

namespace sovo::bridge {

namespace cdr_detail {

/// Reads XCDR1. What goes wrong makes everything after it read as nothing.
class Decoder {
 public:
  explicit Decoder(CdrBytes bytes);

  template <class T>
  void read(T& value) {
    if constexpr (IsMessage<T>) {
      MessageTraits<T>::visit(value, [this](const char*, auto& field) { this->read(field); });
    } else if constexpr (IsSequence<T>) {
      read_sequence(value);
    } else if constexpr (std::is_array_v<T>) {
      for (auto& element : value) read(element);
    } else if constexpr (std::is_same_v<T, char*>) {
      value = const_cast<char*>(text());
    } else if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t byte = 0;  // any byte may come, and not every one is a bool
      number(&byte, 1, 1);
      value = byte != 0;
    } else {
      number(&value, sizeof(T), 1);
    }
  }

  const std::string& error() const { return error_; }
  std::deque<std::vector<std::max_align_t>> take_memory() { return std::move(memory_); }

 private:
  /// `count` numbers of `size` bytes, in this machine's order.
  void number(void* to, std::size_t size, std::size_t count);
  /// Text with its final zero, where it lies.
  const char* text();
  /// Length of a sequence that fits into what is left.
  std::uint32_t length(std::size_t least_element_size);
  void* allocate(std::size_t size);

  template <class S>
  void read_sequence(S& sequence) {
    using T = std::remove_pointer_t<decltype(sequence._buffer)>;
    sequence = {};
    constexpr bool kIsNumber = std::is_arithmetic_v<T>;
    const std::uint32_t count = length(kIsNumber ? sizeof(T) : 1);
    if (count == 0) return;
    sequence._length = sequence._maximum = count;
    if constexpr (kIsNumber && sizeof(T) == 1) {
      sequence._buffer = reinterpret_cast<T*>(const_cast<std::uint8_t*>(bytes_.data() + at_));
      at_ += count;
    } else {
      sequence._buffer = static_cast<T*>(allocate(count * sizeof(T)));
      if constexpr (kIsNumber) {
        number(sequence._buffer, sizeof(T), count);
      } else {
        for (std::uint32_t i = 0; i < count; ++i) read(*new (sequence._buffer + i) T{});
      }
    }
  }

  CdrBytes bytes_;  // after the encapsulation header, which alignment counts from
  std::size_t at_ = 0;
  bool swap_ = false;
  std::string error_;
  std::deque<std::vector<std::max_align_t>> memory_;
};

/// Writes little-endian XCDR1.
class Encoder {
 public:
  Encoder() : bytes_{0, 1, 0, 0} {}

  template <class T>
  void write(const T& value) {
    if constexpr (IsMessage<T>) {
      MessageTraits<T>::visit(value,
                              [this](const char*, const auto& field) { this->write(field); });
    } else if constexpr (IsSequence<T>) {
      write(sequence_length(value));
      write_elements(value._buffer, value._length);
    } else if constexpr (std::is_array_v<T>) {
      write_elements(&value[0], std::extent_v<T>);
    } else if constexpr (std::is_same_v<T, char*>) {
      text(value);
    } else {
      number(&value, sizeof(T), 1);
    }
  }

  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  template <class S>
  static std::uint32_t sequence_length(const S& sequence) {
    return sequence._length;
  }
  template <class T>
  void write_elements(const T* elements, std::size_t count) {
    if constexpr (std::is_arithmetic_v<T>) {
      if (count > 0) number(elements, sizeof(T), count);
    } else {
      for (std::size_t i = 0; i < count; ++i) write(elements[i]);
    }
  }
  void number(const void* from, std::size_t size, std::size_t count);
  void text(const char* value);

  std::vector<std::uint8_t> bytes_;
};

}  // namespace cdr_detail

/// A message read from serialized bytes, which it borrows texts and images from.
template <class T>
class Decoded {
 public:
  const T& operator*() const { return message_; }
  const T* operator->() const { return &message_; }

 private:
  template <class M>
  friend Result<Decoded<M>> decode(CdrBytes bytes);

  T message_{};
  std::deque<std::vector<std::max_align_t>> memory_;
};

/// The message in `bytes`, which begin with their encapsulation header and may come from anyone.
/// `bytes` must outlive the result.
template <class T>
Result<Decoded<T>> decode(CdrBytes bytes) {
  cdr_detail::Decoder decoder(bytes);
  Decoded<T> result;
  decoder.read(result.message_);
  if (!decoder.error().empty()) {
    return Error{std::string(MessageTraits<T>::kRosName) + ": " + decoder.error()};
  }
  result.memory_ = decoder.take_memory();
  return result;
}

/// Serialized bytes of a message, with their encapsulation header.
template <class T>
std::vector<std::uint8_t> encode(const T& message) {
  cdr_detail::Encoder encoder;
  encoder.write(message);
  return encoder.take();
}

}  // namespace sovo::bridge
