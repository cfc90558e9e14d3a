#include "sovo/bridge/dashboard/client_queue.h"

#include <algorithm>
#include <utility>

namespace sovo::bridge {
namespace {

// What a message takes beside its payload.
constexpr std::size_t kOverhead = 64;
// An older picture of the same camera is of no use.
constexpr std::ptrdiff_t kImagesWaiting = 2;

std::size_t size_of(const QueuedMessage& message) { return message.payload->size() + kOverhead; }

}  // namespace

void ClientQueue::drop(std::deque<QueuedMessage>::iterator at) {
  ++missed_[at->subscription];
  bytes_ -= size_of(*at);
  messages_.erase(at);
}

bool ClientQueue::make_room(std::size_t bytes, Importance importance) {
  while (bytes_ + bytes > max_bytes_) {
    const auto least =
        std::min_element(messages_.begin(), messages_.end(),
                         [](const auto& a, const auto& b) { return a.importance < b.importance; });
    if (least == messages_.end() || least->importance > importance) return false;
    drop(least);
  }
  return true;
}

void ClientQueue::push(QueuedMessage message) {
  if (message.importance == Importance::kImage) {
    const auto same = [&](const auto& m) { return m.subscription == message.subscription; };
    if (std::count_if(messages_.begin(), messages_.end(), same) >= kImagesWaiting) {
      drop(std::find_if(messages_.begin(), messages_.end(), same));
    }
  }
  const std::size_t bytes = size_of(message);
  if (!make_room(bytes, message.importance)) {
    ++missed_[message.subscription];
    return;
  }
  bytes_ += bytes;
  messages_.push_back(std::move(message));
}

std::optional<QueuedMessage> ClientQueue::pop() {
  if (messages_.empty()) return std::nullopt;
  QueuedMessage message = std::move(messages_.front());
  messages_.pop_front();
  bytes_ -= size_of(message);
  return message;
}

void ClientQueue::remove(std::uint32_t subscription) {
  std::erase_if(messages_, [&](const QueuedMessage& m) {
    if (m.subscription != subscription) return false;
    bytes_ -= size_of(m);
    return true;
  });
  missed_.erase(subscription);
}

std::map<std::uint32_t, std::uint64_t> ClientQueue::take_missed() {
  return std::exchange(missed_, {});
}

}  // namespace sovo::bridge
