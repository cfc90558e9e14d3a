#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sovo/bridge/dashboard/web_types.h"

namespace sovo::bridge {

/// What is given up first when a client is slow, from first to last.
enum class Importance { kImage, kCloud, kState, kPose };

/// A message on its way to a client.
struct QueuedMessage {
  std::uint32_t subscription = 0;
  std::int64_t stamp_ns = 0;
  Importance importance = Importance::kState;
  SharedBytes payload;
};

/// Messages that wait for a slow client, bounded in bytes. What does not fit costs the oldest of
/// the least important ones; a message is never kept at the price of a more important one.
///
/// Not for several threads.
class ClientQueue {
 public:
  explicit ClientQueue(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void push(QueuedMessage message);
  /// The oldest message.
  std::optional<QueuedMessage> pop();
  /// Forgets what waits for a subscription; that counts as nothing missed.
  void remove(std::uint32_t subscription);

  std::size_t bytes() const { return bytes_; }
  std::size_t size() const { return messages_.size(); }
  /// How many messages of each subscription were given up since the last call.
  std::map<std::uint32_t, std::uint64_t> take_missed();
  bool has_missed() const { return !missed_.empty(); }

 private:
  void drop(std::deque<QueuedMessage>::iterator at);
  bool make_room(std::size_t bytes, Importance importance);

  std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  std::deque<QueuedMessage> messages_;
  std::map<std::uint32_t, std::uint64_t> missed_;
};

}  // namespace sovo::bridge
