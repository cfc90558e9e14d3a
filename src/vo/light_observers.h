#pragma once

namespace sovo {

class MovingLight;
class VignetteEstimate;

/// What learns of the light from the keyframes of all maps; null for what is known.
struct LightObservers {
  VignetteEstimate* vignette = nullptr;
  MovingLight* moving = nullptr;
};

}  // namespace sovo
