#pragma once

namespace sovo {

/// What static residuals tell a window: its scale as well, or how far its points are relative to
/// each other alone, one factor of all their depths left open.
enum class StaticScale { kHeld, kFree };

}  // namespace sovo
