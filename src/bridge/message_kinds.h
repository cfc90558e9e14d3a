#pragma once

#include "message_traits.h"

namespace sovo::bridge {

/// A message type of the idl folder, as idlc makes it for C.
template <class T>
concept IsMessage = requires {
  MessageTraits<T>::kRosName;
};

/// A sequence as idlc makes it for C.
template <class T>
concept IsSequence = requires(T t) {
  t._buffer;
};

}  // namespace sovo::bridge
