#pragma once

#include <cstdint>
#include <optional>
#include <set>

namespace sovo::bridge {

/// Follows one publisher of stereo frames: the first heard, until it is gone.
///
/// A publisher is a participant of the bus and the session it writes. While the followed one
/// lives, frames of others are refused and their sessions reported once each.
class SessionLock {
 public:
  enum class Verdict {
    kFollowed,    ///< From the publisher that is followed.
    kSwitched,    ///< The first frame of a publisher that is followed from now on.
    kForeign,     ///< From another publisher; already reported.
    kNewForeign,  ///< From another publisher, the first of its session: to be reported.
  };

  /// Follows a publisher whose calibration was heard before its frames, unless another is followed
  /// and alive.
  template <class Alive>
  void prefer(std::uint64_t publisher, Alive&& is_alive) {
    if (followed_ && (followed_->publisher == publisher || is_alive(followed_->publisher))) return;
    followed_ = Followed{publisher, std::nullopt};
  }

  /// Judges a frame. `is_alive(publisher)` says whether the followed publisher is still there; it
  /// is asked only about frames of others.
  template <class Alive>
  Verdict judge(std::uint64_t publisher, std::uint64_t session, Alive&& is_alive) {
    const bool other = followed_ && followed_->publisher != publisher;
    if (other && is_alive(followed_->publisher)) {
      ++foreign_frames_;
      if (reported_.size() >= kMostReported) reported_.clear();
      return reported_.insert(session).second ? Verdict::kNewForeign : Verdict::kForeign;
    }
    if (followed_ && !other && followed_->session == session) return Verdict::kFollowed;
    followed_ = Followed{publisher, session};
    reported_.clear();
    return Verdict::kSwitched;
  }

  /// Frames refused because they came from another publisher.
  std::uint64_t foreign_frames() const { return foreign_frames_; }
  /// Publisher that is followed.
  std::optional<std::uint64_t> publisher() const {
    return followed_ ? std::optional(followed_->publisher) : std::nullopt;
  }

 private:
  static constexpr std::size_t kMostReported = 64;  // a flood of sessions takes no memory

  struct Followed {
    std::uint64_t publisher;
    std::optional<std::uint64_t> session;  ///< Unknown before its first frame.
  };

  std::optional<Followed> followed_;
  std::set<std::uint64_t> reported_;
  std::uint64_t foreign_frames_ = 0;
};

/// Counts the numbers missing in a sequence that should rise by one.
class GapCounter {
 public:
  /// Begins anew: the next number is the first.
  void restart() { last_.reset(); }

  /// Takes the next number; numbers that do not rise count nothing (a replay began again).
  void count(std::uint64_t sequence) {
    if (last_ && sequence > *last_) lost_ += sequence - *last_ - 1;
    last_ = sequence;
  }

  std::uint64_t lost() const { return lost_; }

 private:
  std::optional<std::uint64_t> last_;
  std::uint64_t lost_ = 0;
};

}  // namespace sovo::bridge
