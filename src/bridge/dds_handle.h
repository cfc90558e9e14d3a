#pragma once

#include <dds/dds.h>

#include <memory>
#include <string>
#include <utility>

#include "sovo/io/result.h"

namespace sovo::bridge {

/// Owns one Cyclone DDS entity (domain, participant, topic, reader, writer, condition, waitset)
/// and deletes it, with its children, at the end.
class DdsHandle {
 public:
  DdsHandle() = default;
  explicit DdsHandle(dds_entity_t entity) : entity_(entity) {}
  ~DdsHandle() { reset(); }
  DdsHandle(DdsHandle&& other) noexcept : entity_(std::exchange(other.entity_, 0)) {}
  DdsHandle& operator=(DdsHandle&& other) noexcept {
    if (this != &other) {
      reset();
      entity_ = std::exchange(other.entity_, 0);
    }
    return *this;
  }
  DdsHandle(const DdsHandle&) = delete;
  DdsHandle& operator=(const DdsHandle&) = delete;

  dds_entity_t get() const { return entity_; }
  void reset() {
    if (entity_ > 0) dds_delete(entity_);
    entity_ = 0;
  }

 private:
  dds_entity_t entity_ = 0;
};

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using QosPtr = std::unique_ptr<dds_qos_t, QosDeleter>;

/// "what: text of the DDS return code".
inline Error dds_error(const std::string& what, dds_return_t code) {
  return Error{what + ": " + dds_strretcode(code)};
}

/// Takes over what a dds_create_... call returned, or says what could not be made.
inline Result<DdsHandle> take_entity(dds_entity_t entity, const std::string& what) {
  if (entity < 0) return dds_error(what, entity);
  return DdsHandle(entity);
}

}  // namespace sovo::bridge
