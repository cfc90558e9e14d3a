#include "sovo/bridge/dds_security.h"

#include <dlfcn.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <system_error>

namespace sovo::bridge {
namespace {

namespace fs = std::filesystem;

struct SecurityPlugin {
  const char* property;  ///< "dds.sec.<property>.library"
  const char* file;
  const char* function;  ///< init_ and finalize_ of it
};

constexpr std::array<SecurityPlugin, 3> kSecurityPlugins = {
    {{"auth", "libdds_security_auth.so", "authentication"},
     {"crypto", "libdds_security_crypto.so", "crypto"},
     {"access", "libdds_security_ac.so", "access_control"}}};

struct KeyFile {
  const char* property;
  const char* file;
};

constexpr std::array<KeyFile, 6> kKeyFiles = {
    {{"dds.sec.auth.identity_ca", "identity_ca.cert.pem"},
     {"dds.sec.auth.identity_certificate", "cert.pem"},
     {"dds.sec.auth.private_key", "key.pem"},
     {"dds.sec.access.permissions_ca", "permissions_ca.cert.pem"},
     {"dds.sec.access.governance", "governance.p7s"},
     {"dds.sec.access.permissions", "permissions.p7s"}}};

/// Debian keeps the plugins in a folder beside the library of Cyclone DDS; others beside itself.
/// Names without a folder cannot be loaded.
std::string plugin_path(const std::string& file) {
  Dl_info info{};
  if (::dladdr(reinterpret_cast<const void*>(&dds_create_domain), &info) == 0) return {};
  std::error_code error;
  const fs::path library = fs::canonical(info.dli_fname, error).parent_path();
  for (const fs::path& folder : {library / "libddsc0debian", library}) {
    if (fs::exists(folder / file, error)) return (folder / file).string();
  }
  return {};
}

bool is_readable(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) && ::access(path.c_str(), R_OK) == 0;
}

}  // namespace

Result<void> secure(const std::string& folder, dds_qos_t* qos) {
  for (const SecurityPlugin& plugin : kSecurityPlugins) {
    const std::string path = plugin_path(plugin.file);
    if (path.empty()) {
      return Error{std::string("this Cyclone DDS has no DDS Security: ") + plugin.file +
                   " is not beside it (Debian's libddsc0debian has it); leave dds.security empty"};
    }
    const std::string library = std::string("dds.sec.") + plugin.property + ".library";
    const std::string function = plugin.function;
    dds_qset_prop(qos, (library + ".path").c_str(), path.c_str());
    dds_qset_prop(qos, (library + ".init").c_str(), ("init_" + function).c_str());
    dds_qset_prop(qos, (library + ".finalize").c_str(), ("finalize_" + function).c_str());
  }
  std::error_code error;
  const fs::path keys = fs::absolute(folder, error);
  for (const KeyFile& key : kKeyFiles) {
    const fs::path path = keys / key.file;
    if (!is_readable(path)) {
      return Error{path.string() + " is missing or not readable for this user; " +
                   "config/security/make-keys makes such a folder"};
    }
    dds_qset_prop(qos, key.property, ("file:" + path.string()).c_str());
  }
  return {};
}

}  // namespace sovo::bridge
