#pragma once

#include <string>

#include "sovo/bridge/dds_handle.h"
#include "sovo/io/result.h"

namespace sovo::bridge {

/// Puts DDS Security into the QoS of a participant: authentication, access control and encryption
/// by the keys in `folder`, in the layout of a ROS 2 enclave: identity_ca.cert.pem, cert.pem,
/// key.pem, permissions_ca.cert.pem, governance.p7s and permissions.p7s. The error says which file,
/// or which plugin of Cyclone DDS, is missing.
Result<void> secure(const std::string& folder, dds_qos_t* qos);

}  // namespace sovo::bridge
