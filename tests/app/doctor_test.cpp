#include "sovo/app/doctor.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "io/io_test_support.h"

namespace sovo::app {
namespace {

std::string all_of(const std::vector<Finding>& findings, bool good) {
  std::string text;
  for (const Finding& finding : findings) {
    if (finding.good == good) text += finding.text + "\n" + finding.mend + "\n";
  }
  return text;
}

void write_settings(const TemporaryFolder& root, const std::string& rmem,
                    const std::string& governor, const std::string& errors) {
  root.write("proc/sys/net/core/rmem_max", rmem + "\n");
  root.write("proc/sys/net/ipv4/ipfrag_high_thresh", "134217728\n");
  root.write("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", governor + "\n");
  root.write("proc/net/snmp",
             "Ip: Forwarding ReasmFails\nIp: 1 0\nUdp: InDatagrams RcvbufErrors\n"
             "Udp: 5 " +
                 errors + "\n");
}

TEST(Doctor, EveryFaultHasTheLineThatMendsIt) {
  const TemporaryFolder root;
  write_settings(root, "212992", "powersave", "17");
  root.write("sys/class/video4linux/video7/name", "Camera\n");  // /dev/video7 is not there
  const auto findings = examine_machine(root / "");
  const std::string bad = all_of(findings, false);
  EXPECT_TRUE(contains(bad, "net.core.rmem_max is 212992"));
  EXPECT_TRUE(contains(bad, "net.core.rmem_max=33554432"));
  EXPECT_TRUE(contains(bad, "the CPU governor is powersave"));
  EXPECT_TRUE(contains(bad, "17 UDP packets were dropped"));
  EXPECT_TRUE(contains(bad, "sudo usermod -aG video"));
  for (const Finding& finding : findings) EXPECT_EQ(finding.good, finding.mend.empty());
}

TEST(Doctor, AMachineThatIsWellHasNothingToMend) {
  const TemporaryFolder root;
  write_settings(root, "33554432", "performance", "0");
  const auto findings = examine_machine(root / "");
  EXPECT_GE(findings.size(), 5U);
  EXPECT_EQ(all_of(findings, false), "");
}

}  // namespace
}  // namespace sovo::app
