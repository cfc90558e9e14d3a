#include "sovo/loop/place_index.h"

#include <algorithm>
#include <numeric>
#include <random>

namespace sovo {
namespace {

/// Descriptors that differ in more bits are of different things.
constexpr int kMostDifferent = 60;
/// The same of their first 32 bits: two standard deviations more than an eighth.
constexpr int kMostDifferentOf32 = 12;

std::uint32_t first_bits_of(const BinaryDescriptor& descriptor) {
  return static_cast<std::uint32_t>(descriptor.bits[0]);
}

/// A bucket with more entries tells too little to be worth its time.
constexpr std::size_t kLongestBucket = 1000;

}  // namespace

PlaceIndex::PlaceIndex() : buckets_(static_cast<std::size_t>(kTables) << kKeyBits) {
  std::mt19937 generator(14);  // NOLINT(cert-msc51-cpp): the same places for the same images
  for (int t = 0; t < kTables; ++t) {
    std::vector<std::uint8_t> bits(256);
    std::iota(bits.begin(), bits.end(), std::uint8_t{0});
    for (std::size_t i = 0; i < kKeyBits; ++i) {
      std::swap(bits[i], bits[i + generator() % (bits.size() - i)]);
    }
    bits.resize(kKeyBits);
    key_bits_.push_back(std::move(bits));
  }
}

PlaceIndex::Key PlaceIndex::key(int table, const BinaryDescriptor& descriptor) const {
  Key key = 0;
  for (const std::uint8_t bit : key_bits_[static_cast<std::size_t>(table)]) {
    key = (key << 1U) | static_cast<Key>((descriptor.bits[bit / 64] >> (bit % 64)) & 1U);
  }
  return (static_cast<Key>(table) << kKeyBits) | key;
}

void PlaceIndex::add(std::uint32_t place, const std::vector<Landmark>& landmarks) {
  std::vector<BinaryDescriptor>& descriptors = descriptors_[place];
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const BinaryDescriptor& descriptor = landmarks[i].keypoint.descriptor;
    descriptors.push_back(descriptor);
    for (int t = 0; t < kTables; ++t) {
      auto& bucket = buckets_[key(t, descriptor)];
      if (bucket.size() >= kLongestBucket) continue;
      bucket.push_back({place, first_bits_of(descriptor), static_cast<std::uint16_t>(i)});
    }
  }
}

void PlaceIndex::forget_before(std::uint32_t place) {
  if (place <= first_) return;
  first_ = place;
  descriptors_.erase(descriptors_.begin(), descriptors_.lower_bound(place));
  for (auto& bucket : buckets_) {
    const auto kept = std::find_if(bucket.begin(), bucket.end(),
                                   [place](const BucketEntry& e) { return e.place >= place; });
    bucket.erase(bucket.begin(), kept);
  }
}

std::vector<PlaceIndex::Votes> PlaceIndex::find(const std::vector<Landmark>& landmarks,
                                                std::uint32_t end, int least, int most,
                                                int apart) const {
  if (end <= first_) return {};
  std::vector<int> votes(end - first_, 0);
  std::vector<std::size_t> last_voter(votes.size(), landmarks.size());
  std::vector<const BinaryDescriptor*> known(votes.size(), nullptr);
  for (const auto& [place, descriptors] : descriptors_) {
    if (place < end) known[place - first_] = descriptors.data();
  }
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const BinaryDescriptor& descriptor = landmarks[i].keypoint.descriptor;
    for (int t = 0; t < kTables; ++t) {
      for (const BucketEntry& candidate : buckets_[key(t, descriptor)]) {
        if (candidate.place >= end) break;  // they ascend
        const std::uint32_t different = candidate.first_bits ^ first_bits_of(descriptor);
        if (sum_of_bytes(ones_by_byte(different)) > kMostDifferentOf32) continue;
        const std::size_t p = candidate.place - first_;
        if (last_voter[p] == i) continue;
        if (hamming(known[p][candidate.landmark], descriptor) > kMostDifferent) continue;
        last_voter[p] = i;
        ++votes[p];
      }
    }
  }
  std::vector<Votes> ranked;
  for (std::size_t p = 0; p < votes.size(); ++p) {
    if (votes[p] >= least) ranked.push_back({first_ + static_cast<std::uint32_t>(p), votes[p]});
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Votes& a, const Votes& b) { return a.votes > b.votes; });
  std::vector<Votes> best;
  for (const Votes& v : ranked) {
    if (static_cast<int>(best.size()) == most) break;
    const bool neighbour = std::any_of(best.begin(), best.end(), [&](const Votes& b) {
      const auto [low, high] = std::minmax(b.place, v.place);
      return high - low <= static_cast<std::uint32_t>(apart);
    });
    if (!neighbour) best.push_back(v);
  }
  return best;
}

}  // namespace sovo
