#include "common/workspace/brick_content.hpp"

#include <algorithm>
#include <cstring>

namespace phantom::workspace {
namespace {

std::uint8_t greatest_code(const BrickData& brick) {
  std::uint8_t greatest = 0;
  for (const std::uint8_t code : brick.mu_code) greatest = std::max(greatest, code);
  return greatest;
}

std::uint8_t greatest_fluid_code(const BrickData& brick) {
  std::uint8_t greatest = 0;
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    const auto code = static_cast<std::uint8_t>(is_fluid(brick.order[i]) ? brick.mu_code[i] : 0);
    greatest = greatest < code ? code : greatest;
  }
  return greatest;
}

std::uint16_t sole_object(const BrickData& brick) {
  const auto first =
      std::find_if(brick.mu_code.begin(), brick.mu_code.end(), [](std::uint8_t code) { return code != 0; });
  const std::uint16_t object = first == brick.mu_code.end()
                                   ? std::uint16_t{0}
                                   : brick.object[static_cast<std::size_t>(first - brick.mu_code.begin())];
  unsigned others = 0;
  for (std::size_t i = 0; i < kBrickVoxels; ++i)
    others |= brick.object[i] ^ (brick.mu_code[i] != 0 ? object : 0U);
  return others == 0 ? object : BrickFacts::kSeveral;
}

bool uniform(const BrickData& brick) {
  return std::memcmp(brick.mu_code.data(), brick.mu_code.data() + 1, kBrickVoxels - 1) == 0 &&
         std::memcmp(brick.order.data(), brick.order.data() + 1, kBrickVoxels - 1) == 0;
}

}  // namespace

BrickFacts facts_of(const BrickData& brick) {
  return {sole_object(brick), uniform(brick), greatest_code(brick), greatest_fluid_code(brick)};
}

}  // namespace phantom::workspace
