#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "sovo/place/place.h"

namespace sovo {

/// Finds places by what they look like, without a vocabulary that had to be learned: descriptors
/// that agree in a few chosen bits are compared as a whole (locality-sensitive hashing; Indyk,
/// Motwani 1998), and those that agree vote for their place.
class PlaceIndex {
 public:
  PlaceIndex();

  struct Votes {
    std::uint32_t place = 0;
    int votes = 0;
  };

  /// Places are numbered by the caller, ascending.
  void add(std::uint32_t place, const std::vector<Landmark>& landmarks);

  /// Forgets all places before `place`.
  void forget_before(std::uint32_t place);

  /// The places before `end` with at least `least` votes, most votes first, at most `most`; of
  /// neighbours (`apart` numbers or fewer from each other) only the best.
  std::vector<Votes> find(const std::vector<Landmark>& landmarks, std::uint32_t end, int least,
                          int most, int apart) const;

 private:
  static constexpr int kTables = 8;
  static constexpr int kKeyBits = 16;
  /// Most of a bucket's entries are told apart by an eighth of the descriptor, which lies in it.
  struct BucketEntry {
    std::uint32_t place;
    std::uint32_t first_bits;
    std::uint16_t landmark;  ///< Of the place.
  };
  using Key = std::uint32_t;

  Key key(int table, const BinaryDescriptor& descriptor) const;

  std::uint32_t first_ = 0;
  std::vector<std::vector<std::uint8_t>> key_bits_;                     ///< Of each table.
  std::map<std::uint32_t, std::vector<BinaryDescriptor>> descriptors_;  ///< By place.
  std::vector<std::vector<BucketEntry>> buckets_;  ///< [table << kKeyBits | key]; ascending.
};

}  // namespace sovo
