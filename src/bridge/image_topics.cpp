#include "sovo/bridge/image_topics.h"

#include <array>
#include <tuple>
#include <utility>
#include <vector>

#include "message_traits.h"

namespace sovo::bridge {
namespace {

constexpr char kCompressed[] = "/compressed";

/// How drivers tell left from right in the names of their topics.
constexpr std::array<std::pair<const char*, const char*>, 9> kSideWords = {
    {{"left", "right"},
     {"cam0", "cam1"},
     {"cam_0", "cam_1"},
     {"camera0", "camera1"},
     {"camera_0", "camera_1"},
     {"image_0", "image_1"},
     {"infra1", "infra2"},
     {"cam1", "cam2"},
     {"port", "starboard"}}};

/// The image topic that a compressed one belongs to, or the topic itself.
std::string uncompressed(const std::string& topic) {
  if (!is_compressed(topic)) return topic;
  return topic.substr(0, topic.size() - std::string(kCompressed).size());
}

/// Whether the last word of the topic says that its images are in colour.
bool is_coloured(const std::string& image_topic) {
  const std::string image = uncompressed(image_topic);
  return image.substr(image.rfind('/') + 1).find("color") != std::string::npos;
}

bool is_image(const RecordedTopic& topic) {
  return topic.messages > 0 && (topic.type == MessageTraits<msg::Image>::kRosName ||
                                topic.type == MessageTraits<msg::CompressedImage>::kRosName);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

/// Pairs of image topics whose names differ by the side only.
std::vector<ImageTopics> named_pairs(const Recording& recording) {
  std::vector<ImageTopics> pairs;
  for (const auto& [name, topic] : recording.topics()) {
    if (!is_image(topic)) continue;
    for (const auto& [left, right] : kSideWords) {
      if (name.find(left) == std::string::npos) continue;
      const RecordedTopic* other = recording.find(replaced(name, left, right));
      if (other == nullptr || !is_image(*other) || other->type != topic.type) continue;
      pairs.push_back({name, other->topic});
      break;
    }
  }
  return pairs;
}

bool has_infos(const Recording& recording, const ImageTopics& pair) {
  return recording.find(info_topic(pair.left)) != nullptr &&
         recording.find(info_topic(pair.right)) != nullptr;
}

std::string image_names(const Recording& recording) {
  std::string names;
  for (const auto& [name, topic] : recording.topics()) {
    if (is_image(topic)) names += (names.empty() ? "" : ", ") + name;
  }
  return names.empty() ? "none" : names;
}

Result<std::string> named_topic(const Recording& recording, const std::string& name) {
  const std::string end = name.starts_with('/') ? name : "/" + name;
  std::vector<std::string> found;
  for (const auto& [full, topic] : recording.topics()) {
    if (!is_image(topic)) continue;
    if (full == name || full == end) return full;
    if (full.ends_with(end)) found.push_back(full);
  }
  if (found.size() == 1) return found.front();
  return Error{name +
               (found.empty() ? " is no image topic of the recording" : " is more than one") +
               "; its image topics are " + image_names(recording)};
}

}  // namespace

std::string info_topic(const std::string& image_topic) {
  const std::string image = uncompressed(image_topic);
  const auto slash = image.rfind('/');
  return slash == std::string::npos ? "camera_info" : image.substr(0, slash + 1) + "camera_info";
}

bool is_rectified(const std::string& image_topic) {
  const std::string image = uncompressed(image_topic);
  return image.substr(image.rfind('/') + 1).find("rect") != std::string::npos;
}

bool is_compressed(const std::string& image_topic) { return image_topic.ends_with(kCompressed); }

Result<ImageTopics> find_image_topics(const Recording& recording, const std::string& left,
                                      const std::string& right) {
  if (!left.empty() && !right.empty()) {
    auto left_name = named_topic(recording, left);
    if (!left_name) return left_name.failure();
    auto right_name = named_topic(recording, right);
    if (!right_name) return right_name.failure();
    return ImageTopics{*left_name, *right_name};
  }
  using Rank = std::tuple<bool, bool, bool, bool>;  // the smallest is the best
  std::vector<ImageTopics> best;
  Rank best_rank;
  for (const ImageTopics& pair : named_pairs(recording)) {
    const Rank rank = {!has_infos(recording, pair), is_compressed(pair.left),
                       is_rectified(pair.left), is_coloured(pair.left)};
    if (best.empty() || rank < best_rank) {
      best.clear();
      best_rank = rank;
    }
    if (rank == best_rank) best.push_back(pair);
  }
  if (best.size() == 1) return best.front();
  return Error{std::string(best.empty() ? "no two image topics are named as a stereo pair"
                                        : "there are images of more than one stereo pair") +
               "; name them with --left and --right (image topics: " + image_names(recording) +
               ")"};
}

}  // namespace sovo::bridge
