#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace sovo {

/// One byte a cell: not 0 for those that are chosen.
using ChosenCells = std::vector<std::uint8_t>;

/// Squares of equal size that an image is cut into, row by row from its upper left corner; those at
/// the right and the lower edge may be cut off.
struct ImageCells {
  ImageCells(int side_px, int image_width, int image_height)
      : side(side_px),
        width(image_width),
        height(image_height),
        columns((image_width + side_px - 1) / side_px),
        rows((image_height + side_px - 1) / side_px) {}

  std::size_t size() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  bool covers(float u, float v) const {
    return u >= 0.0F && v >= 0.0F && u < static_cast<float>(width) &&
           v < static_cast<float>(height);
  }
  /// Of a place in the image, or the nearest one [px].
  std::size_t at(float u, float v) const {
    const float x = std::clamp(u, 0.0F, static_cast<float>(width - 1));
    const float y = std::clamp(v, 0.0F, static_cast<float>(height - 1));
    const int cell = static_cast<int>(y) / side * columns + static_cast<int>(x) / side;
    return static_cast<std::size_t>(cell);
  }
  /// Upper left pixel of a cell.
  int left(std::size_t cell) const { return static_cast<int>(cell) % columns * side; }
  int top(std::size_t cell) const { return static_cast<int>(cell) / columns * side; }

  /// Whether one of the eight around a cell is chosen, or it is itself.
  bool beside(std::size_t cell, const ChosenCells& chosen) const {
    const int column = static_cast<int>(cell) % columns;
    const int row = static_cast<int>(cell) / columns;
    for (int y = std::max(0, row - 1); y <= std::min(rows - 1, row + 1); ++y) {
      for (int x = std::max(0, column - 1); x <= std::min(columns - 1, column + 1); ++x) {
        if (chosen[static_cast<std::size_t>(y * columns + x)] != 0) return true;
      }
    }
    return false;
  }

  /// How many of the eight around a cell are chosen; beyond the image are those at its edge again.
  int num_around(std::size_t cell, const ChosenCells& chosen) const {
    const int column = static_cast<int>(cell) % columns;
    const int row = static_cast<int>(cell) / columns;
    int count = 0;
    for (int y = row - 1; y <= row + 1; ++y) {
      for (int x = column - 1; x <= column + 1; ++x) {
        if (x == column && y == row) continue;
        const int at = std::clamp(y, 0, rows - 1) * columns + std::clamp(x, 0, columns - 1);
        count += chosen[static_cast<std::size_t>(at)] != 0 ? 1 : 0;
      }
    }
    return count;
  }

  int side, width, height, columns, rows;
};

}  // namespace sovo
