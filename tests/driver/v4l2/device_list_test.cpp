#include "sovo/driver/v4l2/device_list.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "io/io_test_support.h"
#include "sovo/driver/v4l2/controls.h"
#include "sovo/driver/v4l2/device_finder.h"

namespace sovo::v4l2 {
namespace {

namespace fs = std::filesystem;

/// A tree like the kernel's.
class DeviceLists : public testing::Test {
 protected:
  void add_usb(int number, const std::string& port, const std::string& ids,
               const std::string& serial, int index = 0) {
    const std::string usb = "devices/" + port;
    folder_.write(usb + "/idVendor", ids.substr(0, 4) + "\n");
    folder_.write(usb + "/idProduct", ids.substr(5) + "\n");
    if (!serial.empty()) folder_.write(usb + "/serial", serial + "\n");
    folder_.write(usb + "/speed", "5000\n");
    const std::string node = "class/video" + std::to_string(number);
    folder_.write(node + "/name", "ZED: ZED\n");
    folder_.write(node + "/index", std::to_string(index) + "\n");
    fs::create_directories(folder_ / (usb + "/1-0:1.0"));
    fs::remove(folder_ / (node + "/device"));
    fs::create_directory_symlink(folder_ / (usb + "/1-0:1.0"), folder_ / (node + "/device"));
    folder_.write("dev/video" + std::to_string(number), "");
  }
  void add_virtual(int number, const std::string& name) {
    folder_.write("class/video" + std::to_string(number) + "/name", name + "\n");
    folder_.write("dev/video" + std::to_string(number), "");
  }
  DeviceTree tree() const { return {folder_ / "class", folder_ / "dev"}; }
  std::vector<DeviceInfo> list() const { return list_devices(tree()); }
  std::string dev(const std::string& name) const { return folder_ / ("dev/" + name); }

  TemporaryFolder folder_;
};

TEST_F(DeviceLists, DevicesAreFoundByPathLinkSerialAndPort) {
  add_virtual(10, "loopback");
  add_usb(2, "1-4", "2b03:f582", "1234");
  add_usb(3, "1-4", "2b03:f582", "1234", 1);
  add_usb(0, "2-1", "046d:0825", "AB");
  fs::create_directories(folder_ / "dev/v4l/by-id");
  fs::create_symlink("../../video0", folder_ / "dev/v4l/by-id/usb-046d_AB-video-index0");
  const auto devices = list();
  ASSERT_EQ(devices.size(), 4U);
  EXPECT_EQ(devices.back().path, dev("video10"));
  for (const std::string& wish :
       {dev("video0"), std::string("usb-046d_AB-video-index0"), std::string("AB"),
        std::string("2-1"), std::string(folder_ / "dev/v4l/by-id/usb-046d_AB-video-index0")}) {
    const auto found = find_device(devices, wish);
    ASSERT_TRUE(found) << wish << ": " << found.error();
    EXPECT_EQ(found->path, dev("video0")) << wish;
  }
  // Nothing named: the ZED, and of its nodes the one with images.
  EXPECT_EQ(find_device(devices, "")->path, dev("video2"));
  EXPECT_EQ(find_device(devices, "1234")->path, dev("video2"));
}

TEST_F(DeviceLists, WhatIsAmbiguousOrMissingListsWhatThereIs) {
  EXPECT_TRUE(contains(find_device(list(), "").error(), "plugged in"));
  add_virtual(0, "one");
  EXPECT_EQ(find_device(list(), "")->path, dev("video0"));
  add_virtual(1, "two");
  const auto several = find_device(list(), "");
  ASSERT_FALSE(several);
  EXPECT_TRUE(contains(several.error(), "video0 (one)")) << several.error();
  const auto none = find_device(list(), "5678");
  ASSERT_FALSE(none);
  EXPECT_TRUE(contains(none.error(), "'5678'") && contains(none.error(), "video1 (two)"));
}

TEST_F(DeviceLists, APluggedInCameraIsKnownAgainUnderAnotherNumber) {
  add_usb(0, "1-4", "2b03:f582", "1234");
  add_usb(1, "1-5", "2b03:f582", "1234");  // cameras whose maker gave all of them one number
  const auto known = find_device(list(), dev("video1"));
  ASSERT_TRUE(known);
  fs::remove_all(folder_ / "class/video1");
  const auto gone = find_again(list(), *known, dev("video1"));
  // The same number in another port could be the camera itself: it is taken.
  ASSERT_TRUE(gone);
  EXPECT_EQ(gone->path, dev("video0"));
  add_usb(4, "1-5", "2b03:f582", "1234");
  EXPECT_EQ(find_again(list(), *known, dev("video1"))->path, dev("video4"));
  fs::remove_all(folder_ / "class");
  EXPECT_TRUE(contains(find_again(list(), *known, dev("video1")).error(), "is gone"));
}

TEST_F(DeviceLists, TwoCamerasOfOneSerialNumberAreNeverExchanged) {
  // A hub with both is unplugged, and the right one is there again before the left one.
  add_usb(0, "1-4", "046d:0825", "0001");
  add_usb(1, "1-5", "046d:0825", "0001");
  DeviceFinder finder({"1-4", dev("video1")}, tree());
  EXPECT_EQ(finder.find(0)->path, dev("video0"));
  EXPECT_EQ(finder.find(1)->path, dev("video1"));
  fs::remove_all(folder_ / "class");
  add_usb(0, "1-5", "046d:0825", "0001");
  const auto left = finder.find(0);
  ASSERT_FALSE(left) << left->path;
  EXPECT_TRUE(contains(left.error(), "port 1-4) is gone")) << left.error();
  EXPECT_EQ(finder.find(1)->path, dev("video0"));
  add_usb(1, "1-4", "046d:0825", "0001");
  EXPECT_EQ(finder.find(0)->path, dev("video1"));
}

TEST_F(DeviceLists, ASerialNumberOfItsOwnIsFollowedToTheOthersPort) {
  add_usb(0, "1-4", "046d:0825", "0001");
  add_usb(1, "1-5", "046d:0825", "0002");
  DeviceFinder finder({"0001", "0002"}, tree());
  EXPECT_EQ(finder.find(0)->path, dev("video0"));
  EXPECT_EQ(finder.find(1)->path, dev("video1"));
  fs::remove_all(folder_ / "class");
  add_usb(2, "1-5", "046d:0825", "0001");
  EXPECT_EQ(finder.find(0)->path, dev("video2"));
  EXPECT_FALSE(finder.find(1));
  add_usb(3, "1-4", "046d:0825", "0002");
  EXPECT_EQ(finder.find(1)->path, dev("video3"));
}

TEST_F(DeviceLists, OneCameraIsNotBoth) {
  add_usb(0, "1-4", "046d:0825", "0001");
  add_virtual(7, "loopback");
  for (const auto& [wish, path] : {std::pair("0001", "video0"), std::pair("video7", "video7")}) {
    const std::string left = wish[0] == 'v' ? dev(wish) : wish;
    const std::string link = folder_ / ("link_to_" + std::string(path));
    fs::create_symlink(dev(path), link);
    DeviceFinder finder({left, link}, tree());
    ASSERT_TRUE(finder.find(0));
    const auto right = finder.find(1);
    ASSERT_FALSE(right);
    EXPECT_TRUE(contains(right.error(), "the other camera already")) << right.error();
  }
}

TEST(Controls, NamesAreThoseOfV4l2Ctl) {
  EXPECT_EQ(control_name("Exposure Time, Absolute"), "exposure_time_absolute");
  EXPECT_EQ(control_name("White Balance, Automatic"), "white_balance_automatic");
  EXPECT_EQ(control_name("  (x) "), "x");
}

TEST(Controls, SettingsAreNameAndNumber) {
  const auto settings = parse_controls({"exposure=80", " gain = -3 "});
  ASSERT_TRUE(settings) << settings.error();
  ASSERT_EQ(settings->size(), 2U);
  EXPECT_EQ(settings->at(1).name, "gain");
  EXPECT_EQ(settings->at(1).value, -3);
  for (const char* bad : {"exposure", "=3", "gain=1.5", "gain=", "gain=x"}) {
    const auto refused = parse_controls({bad});
    ASSERT_FALSE(refused) << bad;
    EXPECT_TRUE(contains(refused.error(), bad));
  }
}

}  // namespace
}  // namespace sovo::v4l2
