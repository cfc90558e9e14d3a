#pragma once

#include <cstdint>
#include <utility>

#include "sovo/bridge/cdr_sertype.h"

namespace sovo::bridge {

/// A received message as it came over the wire. Copies share the bytes; it may be handed to other
/// threads and outlive its reader.
class CdrSample {
 public:
  /// Takes over a reference to a sample of the opaque type (cdr_sertype.h).
  explicit CdrSample(ddsi_serdata* serdata) : serdata_(serdata) {}
  ~CdrSample() {
    if (serdata_ != nullptr) ddsi_serdata_unref(serdata_);
  }
  CdrSample(const CdrSample& other)
      : serdata_(other.serdata_ == nullptr ? nullptr : ddsi_serdata_ref(other.serdata_)) {}
  CdrSample(CdrSample&& other) noexcept : serdata_(std::exchange(other.serdata_, nullptr)) {}
  CdrSample& operator=(CdrSample other) noexcept {
    std::swap(serdata_, other.serdata_);
    return *this;
  }

  /// Encapsulation header and fields; valid while a copy of this sample lives.
  CdrBytes bytes() const { return bytes_of(*serdata_); }
  /// Source timestamp [ns, UTC].
  std::int64_t source_stamp_ns() const { return serdata_->timestamp.v; }

 private:
  ddsi_serdata* serdata_ = nullptr;
};

}  // namespace sovo::bridge
