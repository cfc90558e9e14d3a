#include "vm/uvc_descriptors.h"

namespace sovo::test {
namespace {

/// A descriptor begins with its own length.
void append_with_length(Bytes* out, const Bytes& body) {
  out->push_back(static_cast<std::uint8_t>(body.size() + 1));
  out->insert(out->end(), body.begin(), body.end());
}

Bytes control_units() {
  Bytes units;
  // Camera terminal 1: automatic exposure mode and exposure time.
  append_with_length(&units, {0x24, 2, 1, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0x0a, 0, 0});
  // Processing unit 2: brightness, contrast, hue, saturation, sharpness, gamma, white balance,
  // gain.
  append_with_length(&units, {0x24, 5, 2, 1, 0, 0, 2, 0x7f, 0x12, 0, 0});
  // Output terminal 4.
  append_with_length(&units, {0x24, 3, 4, 1, 1, 0, 2, 0});
  return units;
}

Bytes frame_descriptor(int index, const UvcMode& mode) {
  Bytes body;
  append(&body, {0x24, 5, index, 0});
  append16(&body, mode.width);
  append16(&body, mode.height);
  append32(&body, mode.bytes() * 8 * mode.rates.back());
  append32(&body, mode.bytes() * 8 * mode.rates.front());
  append32(&body, mode.bytes());
  append32(&body, kTicks / mode.rates.back());
  append(&body, {static_cast<int>(mode.rates.size())});
  for (const std::uint32_t rate : mode.rates) append32(&body, kTicks / rate);
  return body;
}

Bytes formats(const std::vector<UvcMode>& modes) {
  Bytes out;
  append_with_length(&out, {0x24, 4,    1,    static_cast<std::uint8_t>(modes.size()),
                            'Y',  'U',  'Y',  '2',
                            0,    0,    0x10, 0,
                            0x80, 0,    0,    0xaa,
                            0,    0x38, 0x9b, 0x71,
                            16,   3,    0,    0,
                            0,    0});
  int index = 0;
  for (const UvcMode& mode : modes) append_with_length(&out, frame_descriptor(++index, mode));
  append_with_length(&out, {0x24, 13, 1, 1, 4});
  return out;
}

void append_bytes(Bytes* out, const Bytes& more) {
  out->insert(out->end(), more.begin(), more.end());
}

}  // namespace

UvcModel zed_model() {
  return {0x2b03,
          0xf582,
          "Technologies, Inc.",
          "ZED",
          "0012345",
          {{4416, 1242, {15}},
           {3840, 1080, {30, 15}},
           {2560, 720, {60, 30, 15}},
           {1344, 376, {100, 60, 30, 15}}}};
}

UvcModel eye_model(bool right) {
  return {0x1209,
          0x0001,
          "Eyes",
          right ? "Eye right" : "Eye left",
          right ? "0000002" : "0000001",
          {{640, 480, {30, 10}}, {320, 240, {30, 10}}}};
}

std::vector<UvcControl> usual_controls() {
  return {{2, 2, 2, 0, 8, 1, 4, 4},
          {2, 3, 2, 0, 8, 1, 4, 4},
          {2, 6, 2, 0, 11, 1, 0, 0},
          {2, 7, 2, 0, 8, 1, 4, 4},
          {2, 8, 2, 0, 8, 1, 4, 4},
          {2, 9, 2, 1, 9, 1, 5, 5},
          {2, 10, 2, 2800, 6500, 100, 4600, 4600},
          {2, 4, 2, 0, 100, 1, 10, 10},
          {2, 11, 1, 0, 1, 1, 1, 1},
          {1, 2, 1, 1, 8, 9, 8, 8},
          {1, 4, 4, 1, 300, 1, 100, 100}};
}

Bytes device_descriptor(const UvcModel& model) {
  Bytes bytes{18, 1, 0x00, 0x02, 0xEF, 2, 1, 64};
  append16(&bytes, model.vendor);
  append16(&bytes, model.product);
  append(&bytes, {0x00, 0x01, 1, 2, 3, 1});
  return bytes;
}

Bytes configuration_descriptor(const std::vector<UvcMode>& modes) {
  Bytes control{13, 0x24, 1, 0x10, 0x01, 0, 0, 0x00, 0x6c, 0xdc, 0x02, 1, 1};
  append_bytes(&control, control_units());
  control[5] = static_cast<std::uint8_t>(control.size());
  control[6] = static_cast<std::uint8_t>(control.size() >> 8);
  Bytes streaming{14, 0x24, 1, 1, 0, 0, 0x81, 0, 4, 0, 0, 0, 1, 0};
  append_bytes(&streaming, formats(modes));
  streaming[4] = static_cast<std::uint8_t>(streaming.size());
  streaming[5] = static_cast<std::uint8_t>(streaming.size() >> 8);

  Bytes all{9, 2, 0, 0, 2, 1, 0, 0x80, 250};
  append_bytes(&all, {8, 11, 0, 2, 0x0E, 3, 0, 2});
  append_bytes(&all, {9, 4, 0, 0, 0, 0x0E, 1, 0, 2});
  append_bytes(&all, control);
  append_bytes(&all, {9, 4, 1, 0, 1, 0x0E, 2, 0, 0});
  append_bytes(&all, streaming);
  append_bytes(&all, {7, 5, 0x81, 2, 0x00, 0x02, 0});
  all[2] = static_cast<std::uint8_t>(all.size());
  all[3] = static_cast<std::uint8_t>(all.size() >> 8);
  return all;
}

Bytes string_descriptor(const std::string& text) {
  Bytes bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char c : text) append(&bytes, {c, 0});
  return bytes;
}

}  // namespace sovo::test
