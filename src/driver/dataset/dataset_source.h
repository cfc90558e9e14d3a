#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "sovo/driver/dataset/frame_decoder.h"
#include "sovo/driver/dataset/layout.h"
#include "sovo/driver/frame_source.h"
#include "sovo/io/calibration.h"
#include "sovo/io/result.h"

namespace sovo {

/// Which frames of which dataset, and when.
struct DatasetOptions {
  std::string path;         ///< Folder of the dataset, see `find_layout`.
  std::string calibration;  ///< File instead of the dataset's own calibration; empty: its own.
  bool reverse = false;     ///< Last frame first, with mirrored stamps t' = first + last - t.
  int start_frame = 0;      ///< Pairs left out at the beginning.
  int max_frames = 0;       ///< Pairs used at most; 0 for all.
  double rate = 0.0;        ///< Frames come at recorded intervals / rate; 0 as fast as they decode.
  bool restamp = false;     ///< Shift the stamps so that the first frame is of now (UTC).
  double frame_rate = 20.0;  ///< Of images that have no stamps [Hz].
  std::string frame_id = "cam_left_camera_optical_frame";

  template <class Visitor>
  void visit(Visitor& v) {
    v("path", path,
      "folder of the dataset: KITTI odometry or raw, EuRoC, TUM-VI, or left/ and right/");
    v("calibration", calibration, "calibration file instead of the dataset's own");
    v("reverse", reverse, "feed the last frame first, with mirrored stamps");
    v("start_frame", start_frame, "pairs to leave out at the beginning");
    v("max_frames", max_frames, "pairs to use at most; 0 for all");
    v("rate", rate, "speed against the recording; 0 is as fast as possible");
    v("restamp", restamp, "shift the stamps so that the first frame is of now");
    v("frame_rate", frame_rate, "rate of images that have no stamps [Hz]");
    v("frame_id", frame_id, "name of the left optical frame");
  }
};

/// What became of a dataset's frames so far.
struct DatasetCounts {
  std::size_t delivered = 0;  ///< Given as `kFrame`.
  std::size_t bad = 0;        ///< Given as `kBadFrame`: missing, damaged, of another size.
};

/// A recorded dataset as a source of frames. A pair with a missing or damaged image, or one of
/// another size than the calibration's, is given as `kBadFrame` with the file and the reason, and
/// the stream goes on; `sequence` counts such pairs too. `session` is left for the caller to set.
class DatasetSource : public FrameSource {
 public:
  /// Precondition: the layout has pairs, the calibration has image sizes.
  DatasetSource(DatasetLayout layout, Calibration calibration, const DatasetOptions& options);

  const StereoRig& rig() const override { return calibration_.rig; }
  SourceResult next(std::chrono::milliseconds timeout) override;
  std::optional<std::size_t> size() const override { return pairs_.size(); }

  const Calibration& calibration() const { return calibration_; }
  LayoutKind layout() const { return layout_.kind; }

  /// For people: what was assumed about the dataset or left out of it.
  const std::vector<std::string>& notes() const { return layout_.notes; }

  /// The recorded stamp of a frame that was given with the stamp `fed` (undoes `reverse` and
  /// `restamp`) [ns].
  std::int64_t original_stamp(std::int64_t fed) const;

  /// Whether the frames run backwards in recorded time.
  bool reversed() const { return options_.reverse; }

  DatasetCounts counts() const { return counts_; }

 private:
  SourceResult decode(std::size_t index) const;
  void begin();

  DatasetLayout layout_;
  Calibration calibration_;
  DatasetOptions options_;
  std::vector<PairRef> pairs_;  ///< As they are fed, with recorded stamps.
  std::int64_t mirror_ns_ = 0;  ///< First plus last recorded stamp.
  std::int64_t shift_ns_ = 0;   ///< Added to stamps by `restamp`.
  bool begun_ = false;
  std::chrono::steady_clock::time_point start_;  ///< When the first frame was due.
  std::optional<SourceResult> waiting_;          ///< Decoded, but not yet due.
  DatasetCounts counts_;
  std::unique_ptr<FrameDecoder> decoder_;  ///< Last: its thread uses the members above.
};

/// Recognises and opens a dataset. The error says what is wrong and what to do.
Result<std::unique_ptr<DatasetSource>> open_dataset(const DatasetOptions& options);

}  // namespace sovo
