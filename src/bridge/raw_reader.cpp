#include "sovo/bridge/raw_reader.h"

#include <array>

namespace sovo::bridge {

Result<RawReader> RawReader::open(const Participant& participant, const std::string& name,
                                  const MessageSchema& type, const TopicQos& qos) {
  RawReader reader;
  const auto done = reader.open_untyped(participant, name, qos, raw_type(type));
  if (!done) return done.failure();
  return reader;
}

Result<int> RawReader::take_each(const Callback& f) {
  constexpr std::size_t kBatch = 8;
  int messages = 0;
  while (true) {
    std::array<ddsi_serdata*, kBatch> taken{};
    std::array<dds_sample_info_t, kBatch> infos{};
    const dds_return_t count =
        dds_takecdr(entity(), taken.data(), kBatch, infos.data(), DDS_ANY_STATE);
    if (count < 0) return dds_error("cannot read " + topic(), count);
    if (count == 0) return messages;
    std::vector<CdrSample> samples;
    for (dds_return_t i = 0; i < count; ++i) {
      samples.emplace_back(taken[static_cast<std::size_t>(i)]);
    }
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (!infos[i].valid_data) continue;  // news of a writer's end, not of data
      ++messages;
      f(std::move(samples[i]), infos[i]);
    }
  }
}

}  // namespace sovo::bridge
