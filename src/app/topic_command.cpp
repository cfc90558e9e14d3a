#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "sovo/app/cdr_decoder.h"
#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/message_text.h"
#include "sovo/app/rate_meter.h"
#include "sovo/app/stop_signal.h"
#include "sovo/bridge/raw_reader.h"
#include "sovo/bridge/ros_names.h"
#include "sovo/bridge/topic_discovery.h"

namespace sovo::app {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

constexpr std::chrono::seconds kPatience(5);
constexpr std::chrono::milliseconds kTopicSlice(100);

struct TopicOptions {
  std::string name;
  bool json = false;
  int count = 0;  ///< Messages or reports after which to end; 0: none.
};

/// A participant, and what it hears of others.
struct Ear {
  bridge::Participant participant;
  bridge::TopicDiscovery discovery;

  static Result<Ear> open(const AppConfig& config) {
    auto participant = bridge::Participant::open(config.dds, "topic");
    if (!participant) return participant.failure();
    auto discovery = bridge::TopicDiscovery::open(*participant);
    if (!discovery) return discovery.failure();
    return Ear{std::move(*participant), std::move(*discovery)};
  }
};

std::string line_of(const bridge::DiscoveredTopic& topic) {
  return fmt::format("{:<40} {:<44} {:>7} {:>7}", topic.name, topic.type, topic.writers,
                     topic.readers);
}

Json json_of(const bridge::DiscoveredTopic& topic) {
  return {{"name", topic.name},
          {"type", topic.type},
          {"writers", topic.writers},
          {"readers", topic.readers}};
}

int list(const AppConfig& config, const TopicOptions& options) {
  StopSignal stop;
  auto ear = Ear::open(config);
  if (!ear) return fail(kFailed, ear.error());
  // Participants tell of themselves as soon as they hear of a new one.
  const auto end = Clock::now() + std::chrono::milliseconds(1500);
  while (Clock::now() < end && !stop.requested()) std::this_thread::sleep_for(kTopicSlice);
  const auto topics = ear->discovery.topics();
  if (!topics) return fail(kFailed, topics.error());
  if (!options.json) {
    std::cout << fmt::format("{:<40} {:<44} {:>7} {:>7}\n", "topic", "type", "writers", "readers");
  }
  for (const auto& topic : *topics) {
    std::cout << (options.json ? json_of(topic).dump() : line_of(topic)) << "\n";
  }
  std::cout << std::flush;
  if (topics->empty()) {
    return fail(kFailed, "nobody is on domain " + std::to_string(ear->participant.domain()) +
                             "; are --domain and --network those of the others?");
  }
  return kOk;
}

/// Waits until somebody writes the topic.
Result<bridge::DiscoveredTopic> find(const Ear& ear, const std::string& name, StopSignal& stop) {
  const auto begin = Clock::now();
  while (!stop.requested() && Clock::now() - begin < kPatience) {
    const auto topics = ear.discovery.topics();
    if (!topics) return topics.failure();
    for (const auto& topic : *topics) {
      if (topic.name == name && topic.writers > 0) return topic;
    }
    std::this_thread::sleep_for(kTopicSlice);
  }
  return Error{"nobody writes " + name + "; sovo topic list shows what there is"};
}

/// The type of a topic; one that is not known has no definition.
bridge::MessageSchema schema_of(const bridge::DiscoveredTopic& topic) {
  const bridge::MessageSchema* known = bridge::find_schema(topic.dds_type);
  return known != nullptr ? *known : bridge::MessageSchema{topic.type, topic.dds_type, "", ""};
}

/// What a command does with a topic.
class TopicUser {
 public:
  virtual ~TopicUser() = default;
  virtual Result<void> begin(const bridge::MessageSchema& /*type*/) { return {}; }
  virtual Result<void> take(const bridge::CdrSample& sample) = 0;
  /// Called now and then; whether the command is done.
  virtual bool is_done() = 0;
};

int follow(const AppConfig& config, const TopicOptions& options, TopicUser& user) {
  StopSignal stop;
  auto ear = Ear::open(config);
  if (!ear) return fail(kFailed, ear.error());
  const std::string name = ear->participant.topic(options.name);
  const auto topic = find(*ear, name, stop);
  if (!topic) return stop.requested() ? kOk : fail(kFailed, topic.error());
  const bridge::MessageSchema type = schema_of(*topic);
  if (auto begun = user.begin(type); !begun) return fail(kFailed, begun.error());
  auto reader = bridge::RawReader::open(ear->participant, name, type, topic->qos);
  if (!reader) return fail(kFailed, reader.error());
  auto last = Clock::now();
  while (!stop.requested() && !user.is_done()) {
    reader->wait(kTopicSlice);
    Result<void> used;
    const auto taken = reader->take_each([&](const bridge::CdrSample& sample, const auto&) {
      if (used && !user.is_done()) used = user.take(sample);
    });
    if (!taken) return fail(kFailed, taken.error());
    if (!used) return fail(kFailed, used.error());
    if (*taken > 0) last = Clock::now();
    if (Clock::now() - last < kPatience) continue;
    const std::string silence =
        fmt::format("nothing on {} for {} s", name, std::chrono::seconds(kPatience).count());
    if (options.count > 0) return fail(kFailed, silence);
    spdlog::warn("{}", silence);
    last = Clock::now();
  }
  return kOk;
}

class Echo : public TopicUser {
 public:
  explicit Echo(const TopicOptions& options) : options_(options) {}

  Result<void> begin(const bridge::MessageSchema& type) override {
    if (type.definition.empty()) {
      return Error{"the fields of " + type.ros_name +
                   " are not known; hz and bw work all the same"};
    }
    auto decoder = CdrDecoder::make(type.ros_name, type.definition);
    if (!decoder) return decoder.failure();
    decoder_ = std::move(*decoder);
    return {};
  }

  Result<void> take(const bridge::CdrSample& sample) override {
    const auto message = decoder_->decode(sample.bytes());
    if (!message) {
      spdlog::warn("not shown: {}", message.error());
      return {};
    }
    ++shown_;
    if (options_.json) {
      std::cout << message->dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
    } else {
      std::cout << message_text(*message) << "\n---" << std::endl;
    }
    return {};
  }

  bool is_done() override { return options_.count > 0 && shown_ >= options_.count; }

 private:
  const TopicOptions& options_;
  std::optional<CdrDecoder> decoder_;
  int shown_ = 0;
};

std::string hz_text(const RateMeter::Rate& rate) {
  return fmt::format("{:.2f} Hz; intervals {:.1f} to {:.1f} ms, deviation {:.1f} ms; {} messages",
                     rate.hertz, 1e3 * rate.shortest_s, 1e3 * rate.longest_s,
                     1e3 * rate.deviation_s, rate.messages);
}

std::string bw_text(const RateMeter::Rate& rate) {
  return fmt::format("{:.3f} MB/s; {:.1f} kB a message, {:.1f} to {:.1f} kB; {} messages",
                     1e-6 * rate.bytes_per_s, 1e-3 * rate.mean_bytes,
                     1e-3 * static_cast<double>(rate.smallest),
                     1e-3 * static_cast<double>(rate.largest), rate.messages);
}

Json rate_json(const RateMeter::Rate& rate) {
  return {{"hz", rate.hertz},
          {"shortest_s", rate.shortest_s},
          {"longest_s", rate.longest_s},
          {"deviation_s", rate.deviation_s},
          {"bytes_per_s", rate.bytes_per_s},
          {"mean_bytes", rate.mean_bytes},
          {"smallest_bytes", rate.smallest},
          {"largest_bytes", rate.largest},
          {"messages", rate.messages}};
}

/// A line a second about how often, or how much, is written.
class Measure : public TopicUser {
 public:
  using Text = std::string (*)(const RateMeter::Rate&);
  Measure(const TopicOptions& options, Text text) : options_(options), text_(text) {}

  Result<void> take(const bridge::CdrSample& sample) override {
    meter_.add(Clock::now(), sample.bytes().size());
    return {};
  }

  bool is_done() override {
    const auto now = Clock::now();
    if (now - last_report_ >= std::chrono::seconds(1)) {
      last_report_ = now;
      report(now);
    }
    return options_.count > 0 && reports_ >= options_.count;
  }

 private:
  void report(Clock::time_point now) {
    const auto rate = meter_.rate(now);
    if (!rate) return;
    ++reports_;
    std::cout << (options_.json ? rate_json(*rate).dump() : text_(*rate)) << std::endl;
  }

  const TopicOptions& options_;
  Text text_;
  RateMeter meter_;
  Clock::time_point last_report_ = Clock::now();
  int reports_ = 0;
};

using Work = std::function<int(const AppConfig&, const TopicOptions&)>;

void add_one(const Command& parent, const std::string& name, const std::string& help, bool of_one,
             const Work& work) {
  const Command command = parent.add_command(name, help);
  auto topic = std::make_shared<TopicOptions>();
  if (of_one) {
    command.option("name", "Topic, below the namespace or with a leading slash", &topic->name)
        .required();
    command.option("--count", "End after so many messages (echo) or lines", &topic->count)
        .type("N");
  }
  command.flag("--json", "A line of JSON each", &topic->json);
  auto options = std::make_shared<ConfigOptions>(command);
  add_dds_options(*options);
  command.action([options, topic, work] {
    const auto config = options->load();
    return config ? work(*config, *topic) : fail(kUsage, config.error());
  });
}

}  // namespace

void add_topic_command(const Command& program) {
  const Command command = program.add_command("topic", "Look at the topics of the bus");
  command.require_command();
  add_one(command, "list", "Topics of all processes in the domain", false, list);
  add_one(command, "hz", "How often a topic is written", true,
          [](const AppConfig& config, const TopicOptions& options) {
            Measure measure(options, hz_text);
            return follow(config, options, measure);
          });
  add_one(command, "bw", "How much is written to a topic", true,
          [](const AppConfig& config, const TopicOptions& options) {
            Measure measure(options, bw_text);
            return follow(config, options, measure);
          });
  add_one(command, "echo", "The messages of a topic", true,
          [](const AppConfig& config, const TopicOptions& options) {
            Echo echo(options);
            return follow(config, options, echo);
          });
}

}  // namespace sovo::app
