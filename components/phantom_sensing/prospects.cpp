#include "components/phantom_sensing/prospects.hpp"

#include <algorithm>
#include <limits>

namespace phantom::phantom_sensing {
namespace {

bool nears_faster(const Prospect& a, const Prospect& b) noexcept {
  const bool a_exceeds = a.speed_share > 1.0, b_exceeds = b.speed_share > 1.0;
  if (a_exceeds != b_exceeds) return a_exceeds;
  return a.closing_m_s != b.closing_m_s ? a.closing_m_s > b.closing_m_s : a.mu > b.mu;
}
bool is_thicker(const Prospect& a, const Prospect& b) noexcept {
  return a.mu != b.mu ? a.mu > b.mu : a.closing_m_s > b.closing_m_s;
}

}  // namespace

/// Returns the place of an object's prospects, new if there is none yet; null if there is no room.
Prospects::OfObject* Prospects::place_of(std::uint16_t object, const Prospect& prospect) noexcept {
  const auto found = std::ranges::find(objects_, object, &OfObject::object);
  if (found != objects_.end()) return found;
  if (objects_.push_back({object, prospect, prospect, {}})) return &objects_.back();
  const auto thinnest =
      std::ranges::min_element(objects_, {}, [](const OfObject& one) { return one.thickest.mu; });
  if (thinnest->thickest.mu >= prospect.mu) return nullptr;
  *thinnest = {object, prospect, prospect, {}};
  return thinnest;
}

void Prospects::offer_worst(std::uint16_t object, Prospect prospect) noexcept {
  prospect.closing_m_s = std::numeric_limits<double>::infinity();
  OfObject* const of = place_of(object, prospect);
  if (of != nullptr && is_thicker(prospect, of->thickest)) of->thickest = prospect;
}

bool Prospects::may_matter(std::uint16_t object, const Prospect& prospect,
                           bool counts_at_any_direction) const noexcept {
  const auto found = std::ranges::find(objects_, object, &OfObject::object);
  return found == objects_.end() || is_thicker(prospect, found->thickest) ||
         (counts_at_any_direction && prospect.speed_share > found->fastest.speed_share) ||
         !found->nearing.full() || nears_faster(prospect, found->nearing.back());
}

void Prospects::offer(std::uint16_t object, const Prospect& prospect, bool counts_at_any_direction) noexcept {
  OfObject* const of = place_of(object, prospect);
  if (of == nullptr) return;
  if (is_thicker(prospect, of->thickest)) of->thickest = prospect;
  if (counts_at_any_direction && prospect.speed_share > of->fastest.speed_share) of->fastest = prospect;
  auto& nearing = of->nearing;
  if (nearing.full()) {
    if (!nears_faster(prospect, nearing.back())) return;
    nearing.back() = prospect;
  } else {
    nearing.push_back(prospect);
  }
  for (std::size_t i = nearing.size() - 1; i > 0 && nears_faster(nearing[i], nearing[i - 1]); --i)
    std::swap(nearing[i], nearing[i - 1]);
}

}  // namespace phantom::phantom_sensing
