#include "sovo/bridge/topic_catalog.h"

#include <algorithm>

#include "message_traits.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

template <class T>
CatalogTopic topic(const std::string& name, const TopicQos& qos) {
  return {name, find_schema(MessageTraits<T>::kRosName), qos, false};
}

template <class T>
CatalogTopic on_demand(const std::string& name, const TopicQos& qos) {
  return {name, find_schema(MessageTraits<T>::kRosName), qos, true};
}

void add_side(const std::string& side, std::vector<CatalogTopic>* catalog) {
  catalog->push_back(topic<msg::CameraInfo>(side + "/camera_info", reliable(4)));
  for (const char* image : {"/image_raw", "/image_rect", "/image_color"}) {
    catalog->push_back(on_demand<msg::Image>(side + image, reliable(4)));
  }
  for (const char* image : {"/image_raw", "/preview", "/preview_small"}) {
    catalog->push_back(
        on_demand<msg::CompressedImage>(side + image + std::string("/compressed"), reliable(2)));
  }
}

std::vector<CatalogTopic> make_catalog() {
  using namespace topics;
  std::vector<CatalogTopic> catalog = {
      topic<msg::StereoFrame>(kStereo, kStereoQos),
      topic<msg::StereoCalibration>(kCalibration, kCalibrationQos),
      topic<msg::Odometry>(kOdometry, kOdometryQos),
      topic<msg::ScaledOdometry>(kScaledOdometry, kScaledOdometryQos),
      topic<msg::VoStatus>(kStatus, kStatusQos),
      topic<msg::Keyframe>(kKeyframe, kKeyframeQos),
      on_demand<msg::TrackedPoints>("tracked_points", reliable(2)),
      topic<msg::Path>(kPath, kPathQos),
      topic<msg::Path>(kMapPath, kMapPathQos),
      on_demand<msg::PointCloud2>("points", reliable(2)),
      topic<msg::VoCommand>(kCommand, kCommandQos),
      topic<msg::RecorderCommand>(kRecordCommand, kRecordCommandQos),
      topic<msg::RecorderStatus>(kRecordStatus, kRecordStatusQos),
      topic<msg::TFMessage>(kTf, kTfQos),
      topic<msg::TFMessage>(kTfStatic, kTfStaticQos),
      topic<msg::DiagnosticArray>(kDiagnostics, kDiagnosticsQos),
      topic<msg::Clock>(kClock, kClockQos),
  };
  add_side("left", &catalog);
  add_side("right", &catalog);
  return catalog;
}

}  // namespace

const std::vector<CatalogTopic>& topic_catalog() {
  static const std::vector<CatalogTopic> catalog = make_catalog();
  return catalog;
}

const CatalogTopic* find_topic(const std::string& name) {
  const auto& catalog = topic_catalog();
  const auto found = std::find_if(catalog.begin(), catalog.end(),
                                  [&](const CatalogTopic& t) { return t.name == name; });
  return found == catalog.end() ? nullptr : &*found;
}

}  // namespace sovo::bridge
