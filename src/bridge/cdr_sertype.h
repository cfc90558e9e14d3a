#pragma once

#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>

#include <cstdint>
#include <span>
#include <string>

namespace sovo::bridge {

/// A serialized message: a 4-byte encapsulation header (byte 1 is 1 for little-endian CDR, 0 for
/// big-endian) and the fields.
using CdrBytes = std::span<const std::uint8_t>;

/// What the opaque type takes for a sample when it is written.
struct CdrView {
  CdrBytes bytes;
};

/// A type of which Cyclone DDS knows only the name: messages pass as bytes and are never decoded,
/// so that a type without a descriptor can be read and written too. `dds_type`: as
/// "std_msgs::msg::dds_::Header_"; without key. The caller owns one reference, which
/// dds_create_topic_sertype takes over when it succeeds.
ddsi_sertype* new_cdr_sertype(const std::string& dds_type);

/// The bytes of a sample of the opaque type; precondition: it is one, and has data.
CdrBytes bytes_of(const ddsi_serdata& serdata);

}  // namespace sovo::bridge
