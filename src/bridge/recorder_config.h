#pragma once

#include <string>

#include "sovo/io/recording_config.h"
#include "sovo/io/result.h"

namespace sovo::bridge {

/// Settings of the recorder. Sizes are texts with a unit, as "500MB".
struct RecorderConfig {
  std::string out = "recording";
  std::string topics;
  bool wait = false;
  bool ros_images = false;
  std::string split = "0";
  std::string min_free = "1GB";
  std::string queue = "256MB";
  std::string chunk = "4MB";
  mcap::Compression compression = mcap::Compression::kLz4;

  template <class Visitor>
  void visit(Visitor& v) {
    v("out", out, "folder of the recording, or a file that ends in .mcap");
    v("topics", topics,
      "topics beside the default set, with commas; all: every known type; -NAME: not it");
    v("wait", wait, "begin when record_command says so");
    v("ros_images", ros_images, "write stereo frames as Image and CameraInfo");
    v("split", split, "a file is followed by another beyond this size; 0: never");
    v("min_free", min_free, "recording ends when the disk has less left");
    v("queue", queue, "what may wait for the disk; beyond, messages are dropped and counted");
    v("chunk", chunk, "a chunk is closed beyond this size, and after a second at most");
    v("compression", compression, "of the chunks");
  }
};

/// The sizes that the texts of a configuration say.
struct RecorderSizes {
  RecordingConfig file;
  std::uint64_t queue_bytes = 0;
};

/// The error names the key that is no size.
Result<RecorderSizes> read_sizes(const RecorderConfig& config);

}  // namespace sovo::bridge
