#include "common/workspace/brick_content.hpp"

#include <algorithm>

namespace phantom::workspace {

BrickFacts facts_of(const std::uint8_t* codes, const std::int8_t* orders, const std::uint16_t* objects,
                    std::size_t count) {
  const std::uint8_t* const coded = std::find_if(codes, codes + count, [](std::uint8_t c) { return c != 0; });
  BrickFacts facts{coded == codes + count ? std::uint16_t{0} : objects[coded - codes], true};
  unsigned others = 0;  // bits in which an object differs from the sole one
  for (std::size_t i = 0; i < count; ++i) {
    others |= objects[i] ^ (codes[i] != 0 ? facts.object : 0U);
    facts.uniform &= codes[i] == codes[0] && orders[i] == orders[0];
    facts.greatest_code = std::max(facts.greatest_code, codes[i]);
    facts.greatest_fluid_code =
        std::max(facts.greatest_fluid_code, is_fluid(orders[i]) ? codes[i] : std::uint8_t{0});
  }
  if (others != 0) facts.object = BrickFacts::kSeveral;
  return facts;
}

BrickFacts facts_of(const BrickData& brick) {
  return facts_of(brick.mu_code.data(), brick.order.data(), brick.object.data(), kBrickVoxels);
}

}  // namespace phantom::workspace
