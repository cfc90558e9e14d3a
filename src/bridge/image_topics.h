#pragma once

#include <string>

#include "sovo/io/recording.h"
#include "sovo/io/result.h"

namespace sovo::bridge {

/// "camera_info" beside an image topic, or beside the topic whose images it has compressed.
std::string info_topic(const std::string& image_topic);

/// Whether the last word of the topic says that its images are rectified.
bool is_rectified(const std::string& image_topic);

/// Whether the topic is that of images in a compressed form ("<image>/compressed").
bool is_compressed(const std::string& image_topic);

/// Two image topics that are the cameras of a stereo pair.
struct ImageTopics {
  std::string left;
  std::string right;

  bool rectified() const { return is_rectified(left) && is_rectified(right); }
};

/// The stereo pair of a recording with Image or CompressedImage topics. `left` and `right` name
/// them in full or by how they end; empty: they are found by their names (left and right, cam0 and
/// cam1, ...), those that have camera_info first, then raw before compressed, rectified and
/// coloured ones. The error names what there is to choose from.
Result<ImageTopics> find_image_topics(const Recording& recording, const std::string& left,
                                      const std::string& right);

}  // namespace sovo::bridge
