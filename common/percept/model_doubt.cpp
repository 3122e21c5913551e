#include "common/percept/model_doubt.hpp"

#include <algorithm>

namespace phantom::percept {

bool ModelDoubtMonitor::is_same(const DoubtEvidence& a, const DoubtEvidence& b) const noexcept {
  return a.kind == b.kind && a.link == b.link && (a.position_W_m - b.position_W_m).norm() <= timing_.apart_m;
}

/// Returns the place of the evidence: that of an earlier doubt of the same, or else the oldest one's.
std::uint32_t ModelDoubtMonitor::place_for(const DoubtEvidence& evidence) noexcept {
  const auto kept = std::ranges::find_if(
      places_, [&](const std::optional<DoubtEvidence>& one) { return one && is_same(*one, evidence); });
  std::uint32_t place = next_place_;
  if (kept != places_.end()) {
    place = static_cast<std::uint32_t>(kept - places_.begin());
  } else {
    next_place_ = (next_place_ + 1) % kPlaces;
  }
  places_[place] = evidence;
  return place;
}

void ModelDoubtMonitor::raise(OfKind& of, Changes& changes) noexcept {
  if (of.holding) changes.ended.push_back(*of.holding);
  of.holding = ModelDoubt{++raised_, place_for(*of.beginning), *of.beginning};
  changes.raised.push_back(*of.holding);
  of.beginning.reset();
}

void ModelDoubtMonitor::follow(OfKind& of, const DoubtEvidence& evidence, double dt_s,
                               Changes& changes) noexcept {
  if (of.holding && is_same(of.holding->at, evidence)) {
    of.quiet_s = 0.0;
    of.beginning.reset();
    return;
  }
  if (of.holding) of.quiet_s += dt_s;
  if (!of.beginning || !is_same(*of.beginning, evidence)) {
    of.beginning = evidence;
    of.lasted_s = 0.0;
    return;
  }
  of.lasted_s += dt_s;
  of.beginning->force_N = std::max(of.beginning->force_N, evidence.force_N);
  const double wanted_s = evidence.kind == DoubtKind::kNoForceInside ? timing_.rest_s : timing_.after_s;
  if (of.lasted_s < wanted_s || of.since_raise_s < timing_.least_interval_s) return;
  of.quiet_s = of.since_raise_s = 0.0;
  raise(of, changes);
}

void ModelDoubtMonitor::rest(OfKind& of, double dt_s, Changes& changes) noexcept {
  of.beginning.reset();
  if (!of.holding) return;
  of.quiet_s += dt_s;
  if (of.quiet_s < timing_.clear_after_s) return;
  changes.ended.push_back(*of.holding);
  of.holding.reset();
}

void ModelDoubtMonitor::step(std::span<const DoubtEvidence> evidence, double dt_s,
                             Changes& changes) noexcept {
  const double elapsed_s = dt_s > 0.0 ? dt_s : 0.0;
  for (std::size_t kind = 0; kind < kDoubtKinds; ++kind) {
    of_kind_[kind].since_raise_s += elapsed_s;
    const auto now = std::ranges::find(evidence, static_cast<DoubtKind>(kind), &DoubtEvidence::kind);
    if (now != evidence.end()) {
      follow(of_kind_[kind], *now, elapsed_s, changes);
    } else {
      rest(of_kind_[kind], elapsed_s, changes);
    }
  }
}

void ModelDoubtMonitor::close(Changes& changes) noexcept {
  for (OfKind& of : of_kind_) {
    if (of.holding) changes.ended.push_back(*of.holding);
    of.holding.reset();
    of.beginning.reset();
  }
}

}  // namespace phantom::percept
