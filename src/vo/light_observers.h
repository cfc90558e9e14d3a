#pragma once

namespace sovo {

class MovingLight;
class VignetteEstimate;

/// What learns of the light from the keyframes of all maps; null for what is known.
struct LightObservers {
  VignetteEstimate* vignette = nullptr;
  MovingLight* moving = nullptr;
  /// Whether images are freed of all that changes brightness from place to place in them: with a
  /// vignette that is known, by the light of the world.
  bool known = true;
};

}  // namespace sovo
