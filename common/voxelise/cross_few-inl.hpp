// Private to line_crossings.cpp, which includes it after corner_lanes-inl.hpp, once for each instruction set
// (it has no guard): processes the triangles of a fine mesh, one vector of them at a time.

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstddef>

#include "common/voxelise/line_crossings.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::voxelise::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Crosses triangles that reach over few lines, and sorts out all others. Edge functions are whole numbers
/// below 2³⁷, which a double represents exactly.
class FewLines {
 public:
  static constexpr int kFew = 4;  ///< lines along u, and along v
  static constexpr std::size_t kMaxCrossings = kMaxLanes * kFew * kFew;

  FewLines(const SnappedMesh& mesh, const Axes& axes, const Lines& lines)
      : mesh_(mesh), axes_(axes), lines_(lines) {}

  static std::size_t at_once() { return hn::Lanes(kInts); }

  /// Writes the crossings of the first `valid` of at_once() triangles, at most kMaxCrossings, and returns
  /// the first place after them. Calls other(triangle) for triangles that reach over many lines. `number`:
  /// returns a triangle's number by lane.
  template <class NumberAt, class Other>
  Crossing* cross(const NumberAt& number, std::size_t valid, Crossing* to, const Other& other) {
    const auto triangle = [&](std::size_t lane) HWY_ATTR { return mesh_.triangles[number(lane)]; };
    load_corners(mesh_.points, triangle, at_);
    std::uint32_t few = find_lines(valid, [&](std::size_t lane) { other(triangle(lane)); });
    for (std::size_t lane = 0; few != 0; lane += hn::Lanes(kDoubles), few >>= hn::Lanes(kDoubles)) {
      const auto mask = static_cast<std::uint8_t>(few & ((1U << hn::Lanes(kDoubles)) - 1));
      if (mask != 0) to = cross_vector(lane, mask, to);
    }
    return to;
  }

 private:
  static constexpr hn::ScalableTag<double> kDoubles{};
  static constexpr hn::Rebind<std::int32_t, decltype(kDoubles)> kHalfInts{};
  using Doubles = hn::Vec<decltype(kDoubles)>;
  using Mask = hn::Mask<decltype(kDoubles)>;

  struct Edge {
    Doubles du, dv, value, bias;  // value at the first line; bias −1: lines on the edge do not count
  };

  template <class D>
  static HWY_INLINE std::uint32_t bits_of(D d, hn::Mask<D> mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8;
  }

  /// Finds the lines over which the triangles reach. Returns the triangles that reach over few, one bit each.
  template <class Other>
  HWY_INLINE std::uint32_t find_lines(std::size_t valid, const Other& other) {
    constexpr auto kHalf = static_cast<std::int32_t>(kSub / 2);
    const std::int32_t least[2] = {0, lines_.v.first}, most[2] = {lines_.size_u - 1, lines_.v.last - 1};
    const std::size_t axes[2] = {axes_.u, axes_.v};
    auto reaches = hn::FirstN(kInts, valid), few = reaches;
    for (std::size_t k = 0; k < 2; ++k) {
      const auto a = hn::Load(kInts, at_[0][axes[k]]), b = hn::Load(kInts, at_[1][axes[k]]),
                 c = hn::Load(kInts, at_[2][axes[k]]);
      const auto low = hn::Min(a, hn::Min(b, c)), high = hn::Max(a, hn::Max(b, c));
      const auto first = hn::Max(hn::ShiftRight<kSubBits>(hn::Add(low, hn::Set(kInts, kHalf - 1))),
                                 hn::Set(kInts, least[k]));
      const auto last =
          hn::Min(hn::ShiftRight<kSubBits>(hn::Sub(high, hn::Set(kInts, kHalf))), hn::Set(kInts, most[k]));
      reaches = hn::And(reaches, hn::Not(hn::Gt(first, last)));
      few = hn::And(few, hn::Lt(hn::Sub(high, low), hn::Set(kInts, kFew << kSubBits)));
      hn::Store(first, kInts, first_[k]);
      hn::Store(hn::Sub(last, first), kInts, beyond_[k]);
    }
    const hn::RebindToUnsigned<decltype(kInts)> numbers;
    const auto v = hn::Sub(hn::Load(kInts, first_[1]), hn::Set(kInts, lines_.v.first));
    hn::Store(
        hn::BitCast(numbers, hn::Add(hn::Mul(v, hn::Set(kInts, lines_.size_u)), hn::Load(kInts, first_[0]))),
        numbers, line_);
    const std::uint32_t all = bits_of(kInts, reaches), these = all & bits_of(kInts, few);
    for (std::uint32_t left = all & ~these; left != 0; left &= left - 1)
      other(static_cast<std::size_t>(std::countr_zero(left)));
    return these;
  }

  HWY_INLINE Doubles load(const std::int32_t* from) const {
    return hn::PromoteTo(kDoubles, hn::Load(kHalfInts, from));
  }

  HWY_INLINE Edge edge(std::size_t from, std::size_t to, std::size_t lane, Mask turned) const {
    const auto from_u = load(at_[from][axes_.u] + lane), from_v = load(at_[from][axes_.v] + lane);
    const auto along_u = hn::Sub(load(at_[to][axes_.u] + lane), from_u),
               along_v = hn::Sub(load(at_[to][axes_.v] + lane), from_v);
    Edge e;
    e.du = hn::IfThenElse(turned, hn::Neg(along_u), along_u);
    e.dv = hn::IfThenElse(turned, hn::Neg(along_v), along_v);
    const auto at = [&](const std::int32_t* line) HWY_ATTR {  // position of the first line
      const auto sub = hn::Set(kDoubles, static_cast<double>(kSub)), half = hn::Set(kDoubles, 0.5 * kSub);
      return hn::Add(hn::Mul(load(line + lane), sub), half);
    };
    e.value =
        hn::Sub(hn::Mul(e.du, hn::Sub(at(first_[1]), from_v)), hn::Mul(e.dv, hn::Sub(at(first_[0]), from_u)));
    const auto zero = hn::Zero(kDoubles);
    const auto ours = hn::Or(hn::Gt(e.dv, zero), hn::And(hn::Eq(e.dv, zero), hn::Gt(e.du, zero)));
    e.bias = hn::IfThenElse(ours, zero, hn::Set(kDoubles, -1.0));
    return e;
  }

  /// Crosses the triangles from `lane` on; the bits of `few` select which of them count.
  HWY_INLINE Crossing* cross_vector(std::size_t lane, std::uint8_t few, Crossing* to) {
    const auto zero = hn::Zero(kDoubles), sub = hn::Set(kDoubles, static_cast<double>(kSub));
    const auto minus = [&](std::size_t a, std::size_t b, std::size_t axis)
                           HWY_ATTR { return hn::Sub(load(at_[a][axis] + lane), load(at_[b][axis] + lane)); };
    const auto signed_area = hn::Sub(hn::Mul(minus(1, 0, axes_.u), minus(2, 0, axes_.v)),
                                     hn::Mul(minus(2, 0, axes_.u), minus(1, 0, axes_.v)));
    const auto turned = hn::Lt(signed_area, zero), has_area = hn::Ne(signed_area, zero);
    // Triangles that are counter-clockwise seen along the line face forwards: the line leaves the solid
    // there.
    const auto step = hn::IfThenElse(turned, hn::Set(kDoubles, 1.0), hn::Set(kDoubles, -1.0));
    hn::Store(hn::DemoteTo(kHalfInts, step), kHalfInts, step_ + lane);
    std::uint8_t mask[8] = {few};
    const auto asked = hn::And(has_area, hn::LoadMaskBits(kDoubles, mask));
    const Edge e0 = edge(1, 2, lane, turned), e1 = edge(2, 0, lane, turned), e2 = edge(0, 1, lane, turned);
    const auto more_u = load(beyond_[0] + lane), more_v = load(beyond_[1] + lane);
    const auto area = hn::Abs(signed_area);
    for (int j = 0; j < kFew; ++j) {
      const auto in_v = hn::And(asked, hn::Le(hn::Set(kDoubles, j), more_v));
      if (hn::AllFalse(kDoubles, in_v)) break;
      for (int i = 0; i < kFew; ++i) {
        const auto in_u = hn::And(in_v, hn::Le(hn::Set(kDoubles, i), more_u));
        if (hn::AllFalse(kDoubles, in_u)) break;
        const auto value = [&](const Edge& e) HWY_ATTR {
          const auto along =
              hn::Sub(hn::Mul(hn::Set(kDoubles, j), e.du), hn::Mul(hn::Set(kDoubles, i), e.dv));
          return hn::Add(e.value, hn::Mul(sub, along));
        };
        const auto w0 = value(e0), w1 = value(e1), w2 = value(e2);
        const auto least = hn::Min(hn::Add(w0, e0.bias), hn::Min(hn::Add(w1, e1.bias), hn::Add(w2, e2.bias)));
        const auto hit = hn::And(in_u, hn::Ge(least, zero));
        if (!hn::AllFalse(kDoubles, hit)) to = put(lane, hit, i, j, w1, w2, area, to);
      }
    }
    return to;
  }

  /// Writes the crossings with the line that is (i, j) lines from the first.
  HWY_INLINE Crossing* put(std::size_t lane, Mask hit, int i, int j, Doubles w1, Doubles w2, Doubles area,
                           Crossing* to) const {
    const auto a0 = load(at_[0][axes_.a] + lane), a1 = hn::Sub(load(at_[1][axes_.a] + lane), a0),
               a2 = hn::Sub(load(at_[2][axes_.a] + lane), a0);
    const auto per_area = hn::Div(hn::Set(kDoubles, 1.0), area);
    const auto crossing =
        hn::Add(a0, hn::Add(hn::Mul(hn::Mul(w1, per_area), a1), hn::Mul(hn::Mul(w2, per_area), a2)));
    const auto voxels =
        hn::Mul(hn::Sub(crossing, hn::Set(kDoubles, 0.5 * kSub)), hn::Set(kDoubles, 1.0 / kSub));
    const auto below = hn::Floor(voxels);
    const auto above_it = hn::Sub(voxels, below);
    const auto clear =
        hn::And(hn::Gt(above_it, hn::Set(kDoubles, 1e-6)), hn::Lt(above_it, hn::Set(kDoubles, 1.0 - 1e-6)));
    const auto behind = hn::Add(below, hn::Set(kDoubles, 1.0));
    const auto in_box = hn::Min(hn::Max(behind, hn::Zero(kDoubles)), hn::Set(kDoubles, lines_.size_a));
    alignas(64) std::int32_t at[kMaxLanes];
    hn::Store(hn::DemoteTo(kHalfInts, in_box), kHalfInts, at);
    std::uint32_t hits = bits_of(kDoubles, hit);
    if (const std::uint32_t doubtful = hits & ~bits_of(kDoubles, clear); doubtful != 0) [[unlikely]]
      decide(lane, doubtful, w1, w2, area, at);
    const std::uint32_t first = line_of(i, j);
    for (; hits != 0; hits &= hits - 1) {
      const auto here = static_cast<std::size_t>(std::countr_zero(hits));
      *to++ = {Crossing::event_of(at[here], step_[lane + here]), line_[lane + here] + first};
    }
    return to;
  }
  std::uint32_t line_of(std::int32_t u, std::int32_t v) const {
    return static_cast<std::uint32_t>(v) * static_cast<std::uint32_t>(lines_.size_u) +
           static_cast<std::uint32_t>(u);
  }

  /// Decides crossings that are very close to a voxel's centre, in integers.
  void decide(std::size_t lane, std::uint32_t doubtful, Doubles w1, Doubles w2, Doubles area,
              std::int32_t* at) const {
    alignas(64) double e1[kMaxLanes], e2[kMaxLanes], areas[kMaxLanes];
    hn::Store(w1, kDoubles, e1);
    hn::Store(w2, kDoubles, e2);
    hn::Store(area, kDoubles, areas);
    for (; doubtful != 0; doubtful &= doubtful - 1) {
      const auto here = static_cast<std::size_t>(std::countr_zero(doubtful));
      const auto a = [&](std::size_t corner) { return std::int64_t{at_[corner][axes_.a][lane + here]}; };
      const std::int64_t first =
          first_behind_exactly(a(0), a(1) - a(0), a(2) - a(0), static_cast<std::int64_t>(e1[here]),
                               static_cast<std::int64_t>(e2[here]), static_cast<std::int64_t>(areas[here]));
      at[here] = static_cast<std::int32_t>(std::clamp<std::int64_t>(first, 0, lines_.size_a));
    }
  }

  const SnappedMesh& mesh_;
  Axes axes_;
  Lines lines_;
  alignas(64) CornerLanes at_;
  alignas(64) std::int32_t first_[2][kMaxLanes],
      beyond_[2][kMaxLanes];                   // lines along u and v: the first one, and how many follow
  alignas(64) std::uint32_t line_[kMaxLanes];  // number of the first line
  alignas(64) std::int32_t step_[kMaxLanes];
};

}  // namespace phantom::voxelise::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
