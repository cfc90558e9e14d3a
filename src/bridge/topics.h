#pragma once

#include "sovo/bridge/topic_qos.h"

/// Names and QoS of the topics that the processes share. Names without a leading slash are below
/// the namespace.
namespace sovo::bridge::topics {

inline constexpr char kStereo[] = "stereo";
inline constexpr TopicQos kStereoQos = reliable(4);
inline constexpr char kCalibration[] = "calibration";
inline constexpr TopicQos kCalibrationQos = latched(1);
// Below left/ and right/ of a camera.
inline constexpr char kImageRaw[] = "image_raw";
inline constexpr char kImageRect[] = "image_rect";
inline constexpr char kImageColor[] = "image_color";
inline constexpr char kCameraInfo[] = "camera_info";
inline constexpr TopicQos kImageQos = reliable(4);
inline constexpr char kImageCompressed[] = "image_raw/compressed";
inline constexpr char kPreview[] = "preview/compressed";
inline constexpr char kPreviewSmall[] = "preview_small/compressed";
inline constexpr TopicQos kCompressedQos = reliable(2);
inline constexpr char kOdometry[] = "odom";
inline constexpr TopicQos kOdometryQos = reliable(10);
inline constexpr char kScaledOdometry[] = "scaled_odometry";
inline constexpr TopicQos kScaledOdometryQos = reliable(10);
inline constexpr char kStatus[] = "status";
inline constexpr TopicQos kStatusQos = reliable(10);
inline constexpr char kKeyframe[] = "keyframe";
inline constexpr TopicQos kKeyframeQos = latched(200);
inline constexpr char kTrackedPoints[] = "tracked_points";
inline constexpr TopicQos kTrackedPointsQos = reliable(2);
inline constexpr char kPoints[] = "points";
inline constexpr TopicQos kPointsQos = reliable(2);
inline constexpr char kPath[] = "path";
inline constexpr TopicQos kPathQos = latched(1);
inline constexpr char kMapPath[] = "map_path";
inline constexpr TopicQos kMapPathQos = latched(1);
inline constexpr char kCommand[] = "command";
inline constexpr TopicQos kCommandQos = reliable(10);
inline constexpr char kRecordCommand[] = "record_command";
inline constexpr TopicQos kRecordCommandQos = reliable(10);
inline constexpr char kRecordStatus[] = "record_status";
inline constexpr TopicQos kRecordStatusQos = reliable(10);
inline constexpr char kClock[] = "/clock";
inline constexpr TopicQos kClockQos = reliable(10);
inline constexpr char kTf[] = "/tf";
inline constexpr TopicQos kTfQos = reliable(100);
inline constexpr char kTfStatic[] = "/tf_static";
inline constexpr TopicQos kTfStaticQos = latched(1);
inline constexpr char kDiagnostics[] = "/diagnostics";
inline constexpr TopicQos kDiagnosticsQos = reliable(10);

}  // namespace sovo::bridge::topics
