#include "sovo/bridge/dashboard/foxglove_client.h"

#include <utility>
#include <variant>

namespace sovo::bridge {
namespace {

constexpr std::size_t kMostSubscriptions = 256;
constexpr std::size_t kMostPublished = 16;
constexpr std::size_t kMostTexts = 1000;  // that wait for a client that does not read

}  // namespace

FoxgloveClient::FoxgloveClient(FoxgloveHub& hub) : hub_(hub), queue_(hub.config_.queue_bytes) {}

void FoxgloveClient::opened(std::shared_ptr<WebSocketHandle> socket) {
  const std::lock_guard lock(hub_.mutex_);
  socket_ = std::move(socket);
  hub_.add(this);
}

void FoxgloveClient::closed() {
  const std::lock_guard lock(hub_.mutex_);
  hub_.remove(this);
  socket_.reset();
}

void FoxgloveClient::tell(std::string text) {
  if (texts_.size() >= kMostTexts) return;
  texts_.push_back(std::move(text));
  if (socket_) socket_->wake();
}

void FoxgloveClient::send(QueuedMessage message) {
  queue_.push(std::move(message));
  for (const auto& [subscription, count] : queue_.take_missed()) {
    hub_.totals_.missed += count;
    missed_[subscriptions_[subscription]] += count;
  }
  if (socket_) socket_->wake();
}

void FoxgloveClient::forget(std::uint32_t subscription) {
  queue_.remove(subscription);
  subscriptions_.erase(subscription);
}

void FoxgloveClient::complain(const std::string& what) {
  tell(foxglove::status(foxglove::Level::kWarning, what));
}

/// Once a second at most, and only when the client takes messages again.
void FoxgloveClient::tell_what_was_missed() {
  const auto now = Clock::now();
  if (missed_.empty() || now - told_missed_ < std::chrono::seconds(1)) return;
  told_missed_ = now;
  std::string text = "the connection is too slow; left out since the last notice:";
  const char* separator = " ";
  for (const auto& [topic, count] : std::exchange(missed_, {})) {
    text += separator + std::to_string(count) + " of " + topic;
    separator = ", ";
  }
  texts_.push_back(foxglove::status(foxglove::Level::kWarning, text, "missed"));
}

std::optional<WebFrame> FoxgloveClient::next() {
  const std::lock_guard lock(hub_.mutex_);
  tell_what_was_missed();
  if (!texts_.empty()) {
    WebFrame frame{true, std::move(texts_.front()), nullptr};
    texts_.pop_front();
    return frame;
  }
  auto message = queue_.pop();
  if (!message) return std::nullopt;
  return WebFrame{false, foxglove::message_head(message->subscription, message->stamp_ns),
                  std::move(message->payload)};
}

bool FoxgloveClient::refuse() {
  const std::lock_guard lock(hub_.mutex_);
  ++hub_.totals_.malformed;
  return false;
}

bool FoxgloveClient::receive_text(std::string_view message) {
  const auto request = foxglove::parse_text(message);
  if (!request) return refuse();
  const std::lock_guard lock(hub_.mutex_);
  return std::visit([this](const auto& r) { return accept(r); }, *request);
}

bool FoxgloveClient::accept(const foxglove::Subscribe& request) {
  for (const auto& item : request.items) {
    if (subscriptions_.count(item.subscription) != 0) {
      complain("subscription " + std::to_string(item.subscription) + " exists already");
    } else if (subscriptions_.size() >= kMostSubscriptions) {
      complain("too many subscriptions");
    } else if (const auto at = hub_.topics_.find(item.channel); at == hub_.topics_.end()) {
      complain("there is no channel " + std::to_string(item.channel));
    } else {
      subscriptions_[item.subscription] = at->second.channel.topic;
      hub_.subscribe(this, item.subscription, item.channel);
    }
  }
  return true;
}

bool FoxgloveClient::accept(const foxglove::Unsubscribe& request) {
  for (const std::uint32_t id : request.subscriptions) {
    hub_.unsubscribe(this, id);
    forget(id);
  }
  return true;
}

bool FoxgloveClient::accept(const foxglove::ClientAdvertise& request) {
  if (!hub_.config_.allow_commands) {
    complain("this dashboard only shows; sovo dashboard --allow-commands takes commands");
    return true;
  }
  for (const auto& item : request.items) {
    if (item.encoding != "cdr") {
      complain("commands are taken as cdr, not as '" + item.encoding + "'");
    } else if (published_.size() >= kMostPublished) {
      complain("too many published channels");
    } else if (const auto ready = hub_.bus_.prepare(item.topic, item.type); !ready) {
      tell(foxglove::status(foxglove::Level::kError, ready.error()));
    } else {
      published_[item.id] = item;
    }
  }
  return true;
}

bool FoxgloveClient::accept(const foxglove::ClientUnadvertise& request) {
  for (const std::uint32_t id : request.ids) published_.erase(id);
  return true;
}

bool FoxgloveClient::accept(const foxglove::Unsupported& request) {
  complain("'" + request.op + "' is not offered here");
  return true;
}

bool FoxgloveClient::receive_binary(std::span<const std::uint8_t> bytes) {
  const auto message = foxglove::parse_binary(bytes);
  if (!message) return refuse();
  const std::lock_guard lock(hub_.mutex_);
  const auto at = published_.find(message->channel);
  if (!hub_.config_.allow_commands || at == published_.end()) {
    complain("channel " + std::to_string(message->channel) + " is not open for publishing");
    return true;
  }
  const auto done = hub_.bus_.publish(at->second.topic, message->payload);
  if (done) {
    ++hub_.totals_.commands;
  } else {
    tell(foxglove::status(foxglove::Level::kError, done.error()));
  }
  return true;
}

}  // namespace sovo::bridge
