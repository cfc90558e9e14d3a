#include "sovo/bridge/camera_views.h"

#include <optional>
#include <utility>
#include <vector>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/camera_info_conversion.h"
#include "sovo/bridge/image_conversion.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/stereo_frame_conversion.h"
#include "sovo/bridge/topics.h"
#include "sovo/bridge/writer.h"
#include "sovo/geometry/radtan_fit.h"
#include "sovo/io/jpeg_encoder.h"

namespace sovo::bridge {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMostWaiting = 4;
constexpr int kPreviewWidth = 640;
constexpr int kSmallWidth = 320;
constexpr int kImageQuality = 90;
constexpr int kPreviewQuality = 75;

}  // namespace

/// The topics of one side. All but the counters belongs to the worker.
struct CameraViews::Side {
  Writer<msg::Image> raw;
  Writer<msg::Image> rect;
  Writer<msg::Image> color;
  Writer<msg::CameraInfo> info;
  Writer<msg::CompressedImage> compressed;
  Writer<msg::CompressedImage> preview;
  Writer<msg::CompressedImage> small;

  std::string frame_id;
  std::optional<CameraInfoMessage> info_message;
  CameraModel camera;
  CameraModel rectified_camera;
  Mat3 R_rectified_raw;
  std::optional<RotatedUndistorter> undistorter;  ///< Made when it is first needed.
  JpegEncoder encoder;
  std::vector<std::uint8_t> grey;
  std::vector<std::uint8_t> made_image;

  std::atomic<std::uint64_t> made{0};
  std::atomic<std::uint64_t> failed{0};

  static Result<std::unique_ptr<Side>> open(const Participant& participant,
                                            const std::string& name);
  void show(const SideImage& side, std::int64_t stamp_ns, bool preview_due, bool small_due);
  /// Only of a frame that has colour, and while somebody reads it.
  void show_colour(const SideImage& side, const ColourImage& colour, std::int64_t stamp_ns,
                   ColourReader* reader);

 private:
  Side(Writer<msg::Image> raw_writer, Writer<msg::Image> rect_writer,
       Writer<msg::Image> color_writer, Writer<msg::CameraInfo> info_writer,
       Writer<msg::CompressedImage> compressed_writer, Writer<msg::CompressedImage> preview_writer,
       Writer<msg::CompressedImage> small_writer)
      : raw(std::move(raw_writer)),
        rect(std::move(rect_writer)),
        color(std::move(color_writer)),
        info(std::move(info_writer)),
        compressed(std::move(compressed_writer)),
        preview(std::move(preview_writer)),
        small(std::move(small_writer)) {}

  void check(const Result<void>& written) { ++(written ? made : failed); }
  void compress(const GreyView& image, int quality, const msg::Header& header,
                Writer<msg::CompressedImage>* writer);
  void rectify(const GreyView& image, const msg::Header& header);
};

Result<std::unique_ptr<CameraViews::Side>> CameraViews::Side::open(const Participant& participant,
                                                                   const std::string& name) {
  const auto open_image = [&](const char* topic) {
    return Writer<msg::Image>::open(participant, name + topic, topics::kImageQos);
  };
  auto raw = open_image(topics::kImageRaw);
  if (!raw) return raw.failure();
  auto rect = open_image(topics::kImageRect);
  if (!rect) return rect.failure();
  auto color = open_image(topics::kImageColor);
  if (!color) return color.failure();
  auto info =
      Writer<msg::CameraInfo>::open(participant, name + topics::kCameraInfo, topics::kImageQos);
  if (!info) return info.failure();
  const auto open_compressed = [&](const char* topic) {
    return Writer<msg::CompressedImage>::open(participant, name + topic, topics::kCompressedQos);
  };
  auto compressed = open_compressed(topics::kImageCompressed);
  if (!compressed) return compressed.failure();
  auto preview = open_compressed(topics::kPreview);
  if (!preview) return preview.failure();
  auto small = open_compressed(topics::kPreviewSmall);
  if (!small) return small.failure();
  return std::unique_ptr<Side>(new Side(std::move(*raw), std::move(*rect), std::move(*color),
                                        std::move(*info), std::move(*compressed),
                                        std::move(*preview), std::move(*small)));
}

void CameraViews::Side::compress(const GreyView& image, int quality, const msg::Header& header,
                                 Writer<msg::CompressedImage>* writer) {
  const auto bytes = encoder.encode(image.data, image.width, image.height, image.step, quality);
  if (!bytes) {
    ++failed;
    return;
  }
  msg::CompressedImage m{};
  m.header = header;
  m.format = borrow("mono8; jpeg compressed mono8");
  m.data._buffer = const_cast<std::uint8_t*>(bytes->data());
  m.data._length = m.data._maximum = static_cast<std::uint32_t>(bytes->size());
  check(writer->write(m));
}

void CameraViews::Side::rectify(const GreyView& image, const msg::Header& header) {
  if (!undistorter) undistorter.emplace(camera, rectified_camera, R_rectified_raw);
  const auto size = static_cast<std::size_t>(image.step) * image.height;
  undistorter->apply({image.data, size}, image.step, &made_image);
  msg::Image m{};
  m.header = header;
  m.width = static_cast<std::uint32_t>(image.width);
  m.height = static_cast<std::uint32_t>(image.height);
  m.encoding = borrow("mono8");
  m.step = m.width;
  borrow(m.data, made_image);
  check(rect.write(m));
}

void CameraViews::Side::show(const SideImage& side, std::int64_t stamp_ns, bool preview_due,
                             bool small_due) {
  if (!has_pixels(side)) return;
  const msg::Header header = {to_message(stamp_ns), borrow(frame_id)};
  if (info.num_readers() > 0 && !info.write(info_message->at(stamp_ns))) ++failed;
  if (raw.num_readers() > 0) check(raw.write(to_image(side, header)));
  const bool wants_rect =
      rect.num_readers() > 0 && side.width == camera.width && side.height == camera.height;
  const bool wants_jpeg = compressed.num_readers() > 0;
  preview_due = preview_due && preview.num_readers() > 0;
  small_due = small_due && small.num_readers() > 0;
  if (!wants_rect && !wants_jpeg && !preview_due && !small_due) return;
  const GreyView image = grey_view(side, &grey);
  if (wants_rect) rectify(image, header);
  if (wants_jpeg) compress(image, kImageQuality, header, &compressed);
  if (preview_due) {
    compress(reduced(image, kPreviewWidth, &made_image), kPreviewQuality, header, &preview);
  }
  if (small_due) {
    compress(reduced(image, kSmallWidth, &made_image), kPreviewQuality, header, &small);
  }
}

void CameraViews::Side::show_colour(const SideImage& side, const ColourImage& colour,
                                    std::int64_t stamp_ns, ColourReader* reader) {
  if (!side.valid || !colour.bytes || color.num_readers() == 0) return;
  if (!reader->read(colour, &made_image)) {
    ++failed;
    return;
  }
  msg::Image m{};
  m.header = {to_message(stamp_ns), borrow(frame_id)};
  m.width = static_cast<std::uint32_t>(colour.columns);
  m.height = static_cast<std::uint32_t>(colour.height);
  m.encoding = borrow("rgb8");
  m.step = 3 * m.width;
  borrow(m.data, made_image);
  check(color.write(m));
}

CameraViews::CameraViews(Writer<msg::DiagnosticArray> diagnostics, CameraHealth health)
    : preview_pace_(200ms),
      small_pace_(500ms),
      diagnostics_pace_(1s),
      diagnostics_(std::move(diagnostics)),
      health_(std::move(health)) {}
CameraViews::~CameraViews() = default;

Result<std::unique_ptr<CameraViews>> CameraViews::open(const Participant& participant,
                                                       const StereoCameras& cameras,
                                                       const std::string& left_frame,
                                                       const std::string& right_frame) {
  auto diagnostics = Writer<msg::DiagnosticArray>::open(participant, topics::kDiagnostics,
                                                        topics::kDiagnosticsQos);
  if (!diagnostics) return diagnostics.failure();
  std::unique_ptr<CameraViews> views(
      new CameraViews(std::move(*diagnostics),
                      CameraHealth(participant.config().ns + ": camera", cameras.rig.name)));
  const StereoRig rig = without_ports(cameras.rig);
  const StereoRectification rectification = rectify(rig);
  for (const bool is_left : {true, false}) {
    auto side = Side::open(participant, is_left ? "left/" : "right/");
    if (!side) return side.failure();
    Side& s = **side;
    s.frame_id = is_left ? left_frame : right_frame;
    s.info_message.emplace(rig, rectification, is_left, s.frame_id);
    s.camera = is_left ? rig.left : rig.right;
    s.rectified_camera = is_left ? rectification.left : rectification.right;
    s.R_rectified_raw = is_left ? rectification.R_left : rectification.R_right;
    (is_left ? views->left_ : views->right_) = std::move(*side);
  }
  views->worker_ =
      std::make_unique<BackgroundWorker>("sovo-views", 500ms, [raw = views.get()] { raw->work(); });
  return views;
}

void CameraViews::offer(const StereoFrame& frame, const StereoColour& colour) {
  {
    const std::lock_guard lock(mutex_);
    if (queue_.size() >= kMostWaiting) {
      queue_.pop_front();
      ++skipped_;
    }
    queue_.push_back({frame, colour});
  }
  worker_->wake();
}

ViewCounters CameraViews::counters() const {
  ViewCounters counters;
  counters.made = left_->made + right_->made;
  counters.failed = left_->failed + right_->failed;
  const std::lock_guard lock(mutex_);
  counters.skipped = skipped_;
  return counters;
}

void CameraViews::work() {
  wants_colour_ = left_->color.num_readers() > 0 || right_->color.num_readers() > 0;
  if (!wants_colour_) colour_reader_ = {};  // gives its memory back
  while (true) {
    Offered offered;
    {
      const std::lock_guard lock(mutex_);
      if (queue_.empty()) break;
      offered = std::move(queue_.front());
      queue_.pop_front();
    }
    health_.add(offered.frame, Pace::Clock::now());
    show(offered);
  }
  if (diagnostics_pace_.due()) show_diagnostics();
}

void CameraViews::show_diagnostics() {
  DiagnosticReport report = health_.report(Pace::Clock::now());
  const ViewCounters views = counters();
  report.values.emplace_back("views_made", std::to_string(views.made));
  report.values.emplace_back("views_skipped", std::to_string(views.skipped));
  report.values.emplace_back("views_failed", std::to_string(views.failed));
  const DiagnosticsMessage message(std::move(report), dds_time());
  if (!diagnostics_.write(message.message())) ++left_->failed;
}

void CameraViews::show(const Offered& offered) {
  const StereoFrame& frame = offered.frame;
  const auto now = Pace::Clock::now();
  const bool preview_due = preview_pace_.due(now);
  const bool small_due = small_pace_.due(now);
  left_->show(frame.left, frame.stamp_ns, preview_due, small_due);
  right_->show(frame.right, frame.stamp_ns, preview_due, small_due);
  left_->show_colour(frame.left, offered.colour.left, frame.stamp_ns, &colour_reader_);
  right_->show_colour(frame.right, offered.colour.right, frame.stamp_ns, &colour_reader_);
}

}  // namespace sovo::bridge
