#include "sovo/bridge/mcap_source.h"

#include <algorithm>
#include <utility>

namespace sovo::bridge {

Result<std::unique_ptr<McapSource>> McapSource::open(const McapSourceConfig& config) {
  auto recording = Recording::open(config.path);
  if (!recording) return recording.failure();
  std::unique_ptr<McapSource> source(new McapSource(std::move(*recording)));
  source->path_ = config.path;
  auto frames = RecordedFrames::open(*source->recording_, config.topics);
  if (!frames) return Error{config.path + ": " + frames.error()};
  source->frames_ = std::move(*frames);
  if (config.calibration) {
    source->cameras_ = *config.calibration;
  } else {
    auto cameras = source->frames_->calibration();
    if (!cameras) return Error{config.path + ": " + cameras.error()};
    source->cameras_ = std::move(*cameras);
  }
  source->frames_->rewind();
  std::size_t left_out = 0;
  while (left_out < static_cast<std::size_t>(std::max(config.start, 0)) &&
         source->frames_->next().state != SourceState::kEndOfStream) {
    ++left_out;
  }
  source->size_ = source->frames_->size() - std::min(left_out, source->frames_->size());
  if (config.frames > 0) {
    source->size_ = std::min(source->size_, static_cast<std::size_t>(config.frames));
  }
  return source;
}

SourceResult McapSource::next(std::chrono::milliseconds) {
  if (given_ >= size_) return {SourceState::kEndOfStream, {}, {}};
  SourceResult result = frames_->next();
  if (result.state == SourceState::kFrame) ++given_;
  if (result.state == SourceState::kBadFrame) result.message = path_ + ": " + result.message;
  return result;
}

}  // namespace sovo::bridge
