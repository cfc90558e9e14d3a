// How fast stereo frames are recorded: a camera process of its own sends pairs over loopback DDS,
// and this process records them as `sovo record` does.
//     sovo_bench_record FOLDER [SECONDS [WIDTH HEIGHT HZ]]
// The folder must not exist; it is left for looking at. Exit code 1 when a frame is missing.

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <iomanip>
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "sovo/bridge/recorder.h"
#include "sovo/bridge/stereo_frame_conversion.h"
#include "sovo/bridge/topics.h"

namespace {

using namespace sovo;
using namespace sovo::bridge;
using Clock = std::chrono::steady_clock;

struct Load {
  std::string folder;
  int seconds = 10;
  int width = 1280;
  int height = 720;
  int rate = 60;
};

/// A smooth pattern with noise in the two lowest bits, as cameras have it.
SideImage make_side(const Load& load, unsigned seed) {
  std::mt19937 random(seed);
  auto data = std::make_shared<std::vector<std::uint8_t>>();
  for (int y = 0; y < load.height; ++y) {
    for (int x = 0; x < load.width; ++x) {
      const auto noise = static_cast<int>(random() & 3U);
      data->push_back(static_cast<std::uint8_t>((x * 3 + y * 2) / 16 % 200 + 20 + noise));
    }
  }
  SideImage side;
  side.valid = true;
  side.width = side.step = load.width;
  side.height = load.height;
  side.data = data;
  return side;
}

DdsConfig own_domain() {
  DdsConfig config;
  config.domain = 151;
  return config;
}

/// The camera process: sends everything once a recorder reads.
int publish(const Load& load) {
  const auto participant = Participant::open(own_domain(), "camera", DdsEnvironment{});
  if (!participant) return EXIT_FAILURE;
  auto writer = Writer<msg::StereoFrame>::open(*participant, topics::kStereo, topics::kStereoQos);
  if (!writer) return EXIT_FAILURE;
  while (writer->num_readers() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::vector<StereoFrame> frames(4);
  for (unsigned i = 0; i < frames.size(); ++i) {
    frames[i].session = 1;
    frames[i].left = make_side(load, 2 * i);
    frames[i].right = make_side(load, 2 * i + 1);
  }
  const auto begin = Clock::now();
  const int total = load.seconds * load.rate;
  for (int i = 0; i < total; ++i) {
    std::this_thread::sleep_until(begin +
                                  std::chrono::nanoseconds(1'000'000'000LL * i / load.rate));
    StereoFrame& frame = frames[static_cast<std::size_t>(i) % frames.size()];
    frame.sequence = static_cast<std::uint64_t>(i);
    frame.stamp_ns = dds_time();
    if (!writer->write(to_message(frame))) return EXIT_FAILURE;
  }
  std::this_thread::sleep_for(std::chrono::seconds(1));  // what is on its way arrives
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count() - 1.0;
  std::cout << "sent      " << total << " frames of 2x" << load.width << "x" << load.height
            << " in " << seconds << " s: " << total / seconds << " Hz" << std::endl;
  return EXIT_SUCCESS;
}

/// Says why nothing is recorded, and ends the process that waits for a recorder.
int give_up(const std::string& reason, pid_t camera) {
  std::cerr << reason << "\n";
  ::kill(camera, SIGKILL);
  return EXIT_FAILURE;
}

int record(const Load& load, pid_t camera) {
  const auto participant = Participant::open(own_domain(), "record", DdsEnvironment{});
  if (!participant) return give_up(participant.error(), camera);
  RecorderConfig config;
  config.out = load.folder;
  config.min_free = "100MB";
  auto recorder = Recorder::open(*participant, config);
  const auto started = recorder ? (*recorder)->start() : Result<void>(recorder.failure());
  if (!started) return give_up(started.error(), camera);
  int status = 0;
  std::uint64_t most_waiting = 0;
  while (::waitpid(camera, &status, WNOHANG) == 0) {
    (*recorder)->poll();
    most_waiting = std::max(most_waiting, (*recorder)->state().queued_bytes);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  (*recorder)->stop("done");
  const RecordingState state = (*recorder)->state();
  const auto expected = static_cast<std::uint64_t>(load.seconds * load.rate);
  std::cout << std::fixed << std::setprecision(1) << "recorded  " << state.messages << " messages, "
            << state.dropped << " dropped, " << 1e-6 * static_cast<double>(state.bytes)
            << " MB on disk (lz4), at most " << 1e-6 * static_cast<double>(most_waiting)
            << " MB waiting\n";
  // Not only frames are recorded; a gap in their numbers counts as dropped.
  const bool whole = WIFEXITED(status) && WEXITSTATUS(status) == EXIT_SUCCESS && !state.failed &&
                     state.dropped == 0 && state.messages >= expected;
  std::cout << (whole ? "nothing is lost\n" : "FRAMES ARE MISSING: " + state.reason + "\n");
  return whole ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc == 4 || argc == 5 || argc > 6) {
    std::cerr << "usage: sovo_bench_record FOLDER [SECONDS [WIDTH HEIGHT HZ]]\n";
    return 2;
  }
  Load load;
  load.folder = argv[1];
  if (argc > 2) load.seconds = std::atoi(argv[2]);
  if (argc > 5) {
    load.width = std::atoi(argv[3]);
    load.height = std::atoi(argv[4]);
    load.rate = std::atoi(argv[5]);
  }
  if (load.seconds < 1 || load.width < 1 || load.height < 1 || load.rate < 1) {
    std::cerr << "seconds, width, height and rate are positive numbers\n";
    return 2;
  }
  const pid_t camera = ::fork();  // before there are threads
  if (camera == 0) return publish(load);
  return record(load, camera);
}
