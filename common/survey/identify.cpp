#include "common/survey/identify.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace phantom::survey {
namespace {

constexpr double kClearTurn_rad = 0.3;   // beyond this, the side of a turn is clear …
constexpr double kClearBack_rad = 2.85;  // … up to this: sharper turns may appear to go the other way
constexpr double kExact_m = 2e-4;        // tolerance for corners of a part that a symmetry maps to each other

/// An assignment of a part's nodes to some of the measured faces.
struct Partial {
  NodeMap map;
  std::vector<std::uint32_t> faces;  // of the part, which must be visible
  std::optional<PoseFit> fit;
};

struct Departure {
  double sigmas = 0.0, modelled_m = 0.0;
  bool within = true;
};

class Search {
 public:
  Search(const PartModel& part, const Measurement& measurement, const IdentifyOptions& options)
      : part_(part), measurement_(measurement), options_(options) {
    for (const MeasuredFace& face : measurement.faces)
      metrics_.push_back(face_metrics(corners_of(measurement, face), face.closed, measurement.eye_W_m));
  }

  Candidate run() {
    std::vector<Partial> partials{{NodeMap(measurement_.nodes.size(), kNotMapped), {}, {}}};
    for (std::size_t face = 0; face < measurement_.faces.size() && !partials.empty(); ++face) {
      std::vector<Partial> longer;
      std::set<NodeMap> known;
      for (const Partial& partial : partials) extend(partial, face, longer, known);
      partials = std::move(longer);
    }
    Candidate candidate;
    candidate.all_found = all_found_;
    for (Partial& partial : partials) {
      if (mapped(partial.map) == 0) continue;
      candidate.placements.push_back(placement_of(std::move(partial)));
    }
    std::stable_sort(candidate.placements.begin(), candidate.placements.end(),
                     [](const Placement& a, const Placement& b) { return a.chi2 < b.chi2; });
    if (candidate.placements.size() > options_.most_placements) {
      candidate.placements.resize(options_.most_placements);
      candidate.all_found = false;
    }
    join_symmetric(candidate.placements);
    return candidate;
  }

  Departure departure(const NodeMap& map, std::size_t a, std::size_t b) const {
    const MeasuredNode &m = measurement_.nodes[a], &n = measurement_.nodes[b];
    const double modelled_m = (part_.nodes_O_m[map[a]] - part_.nodes_O_m[map[b]]).norm();
    const double off_m = std::abs((m.p_W_m - n.p_W_m).norm() - modelled_m), sigma_m = distance_sigma_m(m, n);
    return {off_m / sigma_m, modelled_m, off_m <= options_.gate_sigmas * sigma_m + options_.tolerance_m};
  }

 private:
  static std::size_t mapped(const NodeMap& map) {
    return map.size() - static_cast<std::size_t>(std::count(map.begin(), map.end(), kNotMapped));
  }

  void extend(const Partial& from, std::size_t face, std::vector<Partial>& longer, std::set<NodeMap>& known) {
    const MeasuredFace& measured = measurement_.faces[face];
    const std::size_t n = measured.nodes.size();
    for (const BorderLoop& loop : part_.loops) {
      const std::size_t c = loop.nodes.size();
      if (measured.closed ? c != n : c < n) continue;
      for (const bool forward : {true, false}) {
        if (measured.closed && forward != metrics_[face].counter_clockwise) continue;
        for (std::size_t start = 0; start < c; ++start) {
          if (longer.size() >= options_.most_partial) {
            all_found_ = false;
            return;
          }
          try_placing(from, face, loop, start, forward, longer, known);
        }
      }
    }
  }

  void try_placing(const Partial& from, std::size_t face, const BorderLoop& loop, std::size_t start,
                   bool forward, std::vector<Partial>& longer, std::set<NodeMap>& known) {
    const MeasuredFace& measured = measurement_.faces[face];
    const std::size_t n = measured.nodes.size(), c = loop.nodes.size();
    const auto corner = [&](std::size_t i) { return forward ? (start + i) % c : (start + c - i % c) % c; };
    Partial next = from;
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint32_t node = loop.nodes[corner(i)];
      std::uint32_t& place = next.map[measured.nodes[i]];
      if (place == node) continue;
      if (place != kNotMapped || std::find(next.map.begin(), next.map.end(), node) != next.map.end()) return;
      place = node;
      if (!agrees_with_all(next.map, measured.nodes[i])) return;
    }
    for (std::size_t i = measured.closed ? 0 : 1; i < (measured.closed ? n : n - 1); ++i) {
      const double expected = (forward ? 1.0 : -1.0) * loop.turn_rad[corner(i)],
                   seen = metrics_[face].turn_rad[i];
      // Turns count in the measured direction, so they change sign where it runs backward along the part's
      // border. For a closed border the direction follows from its own metrics.
      if (!same_side(expected, seen)) return;
    }
    if (n >= 3) next.faces.push_back(loop.face);
    if (!known.insert(next.map).second || !fits(next)) return;
    longer.push_back(std::move(next));
  }

  bool agrees_with_all(const NodeMap& map, std::size_t node) const {
    for (std::size_t other = 0; other < map.size(); ++other) {
      if (other != node && map[other] != kNotMapped && !departure(map, node, other).within) return false;
    }
    return true;
  }

  static bool same_side(double a, double b) {
    const auto clear = [](double turn) {
      return std::abs(turn) > kClearTurn_rad && std::abs(turn) < kClearBack_rad;
    };
    return !clear(a) || !clear(b) || (a > 0) == (b > 0);
  }

  /// Fits the pose as soon as the nodes determine it, and checks that the head could see these faces.
  bool fits(Partial& partial) const {
    std::vector<Eigen::Vector3d> from, to;
    for (std::size_t i = 0; i < partial.map.size(); ++i) {
      if (partial.map[i] == kNotMapped) continue;
      from.push_back(part_.nodes_O_m[partial.map[i]]);
      to.push_back(measurement_.nodes[i].p_W_m);
    }
    if (from.size() < 3) return true;
    auto fit = refine(part_, measurement_, partial.map, rigid_fit(from, to));
    if (!fit) return true;  // in line: not yet determined
    if (fit->probability() < options_.least_probability) return false;
    const Eigen::Vector3d eye_O = fit->X_WO.inverse() * measurement_.eye_W_m;
    for (const std::uint32_t face : partial.faces) {
      const auto loop = std::find_if(part_.loops.begin(), part_.loops.end(),
                                     [face](const BorderLoop& l) { return l.face == face; });
      if (part_.faces[face].normal_O.dot(eye_O - part_.nodes_O_m[loop->nodes.front()]) <= 0) return false;
    }
    partial.fit = std::move(*fit);
    return true;
  }

  Placement placement_of(Partial partial) const {
    Placement placement;
    placement.map = std::move(partial.map);
    placement.fit = std::move(partial.fit);
    std::set<std::pair<std::size_t, std::size_t>> edges;
    for (const MeasuredFace& face : measurement_.faces) {
      for (std::size_t i = 0; i + (face.closed ? 0 : 1) < face.nodes.size(); ++i)
        edges.insert(std::minmax(face.nodes[i], face.nodes[(i + 1) % face.nodes.size()]));
    }
    for (std::size_t a = 0; a < placement.map.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        if (placement.map[a] == kNotMapped || placement.map[b] == kNotMapped) continue;
        const double sigmas = departure(placement.map, a, b).sigmas;
        placement.worst_sigmas = std::max(placement.worst_sigmas, sigmas);
        if (!placement.fit && edges.contains({b, a})) placement.chi2 += sigmas * sigmas;
      }
    }
    if (placement.fit) placement.chi2 = placement.fit->chi2;
    return placement;
  }

  /// Marks placements that occupy the same space as an earlier one.
  void join_symmetric(std::vector<Placement>& placements) const {
    std::vector<std::size_t> firsts;
    for (std::size_t i = 0; i < placements.size(); ++i) {
      placements[i].same_space_as = i;
      const auto twin = std::find_if(firsts.begin(), firsts.end(), [&](std::size_t first) {
        return same_space(placements[first], placements[i]);
      });
      if (twin == firsts.end()) {
        firsts.push_back(i);
      } else {
        placements[i].same_space_as = *twin;
      }
    }
  }

  bool same_space(const Placement& a, const Placement& b) const {
    if (!a.fit || !b.fit) return false;
    std::vector<Eigen::Vector3d> from, to;
    for (std::size_t i = 0; i < a.map.size(); ++i) {
      if (a.map[i] == kNotMapped || b.map[i] == kNotMapped) continue;
      from.push_back(part_.nodes_O_m[b.map[i]]);
      to.push_back(part_.nodes_O_m[a.map[i]]);
    }
    const geometry::Pose D = rigid_fit(from, to);
    for (std::size_t i = 0; i < from.size(); ++i) {
      if ((D * from[i] - to[i]).norm() > kExact_m) return false;
    }
    return is_symmetry(part_, D);
  }

  const PartModel& part_;
  const Measurement& measurement_;
  const IdentifyOptions& options_;
  std::vector<FaceMetrics> metrics_;
  bool all_found_ = true;
};

std::optional<NearMiss> find_near_miss(const std::vector<PartModel>& library, const Measurement& measurement,
                                       IdentifyOptions options) {
  options.gate_sigmas *= 5.0;
  options.least_probability = 0.0;
  std::optional<NearMiss> nearest;
  double least_chi2 = 0.0;
  for (std::size_t part = 0; part < library.size(); ++part) {
    Search search(library[part], measurement, options);
    const Candidate candidate = search.run();
    if (candidate.placements.empty()) continue;
    const Placement& best = candidate.placements.front();
    if (nearest && least_chi2 <= best.chi2) continue;
    least_chi2 = best.chi2;
    nearest = NearMiss{part, best, 0, 0, 0.0, 0.0, 0.0};
    for (std::size_t a = 0; a < best.map.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        if (best.map[a] == kNotMapped || best.map[b] == kNotMapped) continue;
        const Departure d = search.departure(best.map, a, b);
        if (d.sigmas < nearest->sigmas) continue;
        nearest->node_a = b, nearest->node_b = a;
        nearest->measured_m = (measurement.nodes[a].p_W_m - measurement.nodes[b].p_W_m).norm();
        nearest->modelled_m = d.modelled_m, nearest->sigmas = d.sigmas;
      }
    }
  }
  return nearest;
}

/// Returns the longest edge from a node of the part to an unmeasured one, or 0 if there is none.
double longest_open_edge_m(const PartModel& part, const NodeMap& map, std::uint32_t node) {
  double longest_m = 0.0;
  for (const BorderLoop& loop : part.loops) {
    const std::size_t n = loop.nodes.size();
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint32_t a = loop.nodes[i], b = loop.nodes[(i + 1) % n];
      if (a != node && b != node) continue;
      const std::uint32_t other = a == node ? b : a;
      if (std::find(map.begin(), map.end(), other) == map.end())
        longest_m = std::max(longest_m, loop.edge_m[i]);
    }
  }
  return longest_m;
}

}  // namespace

Identification identify(const std::vector<PartModel>& library, const Measurement& measurement,
                        const IdentifyOptions& options) {
  Identification found;
  for (std::size_t part = 0; part < library.size(); ++part) {
    Candidate candidate = Search(library[part], measurement, options).run();
    candidate.part = part;
    if (!candidate.placements.empty()) found.candidates.push_back(std::move(candidate));
  }
  std::stable_sort(found.candidates.begin(), found.candidates.end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.placements.front().chi2 < b.placements.front().chi2;
                   });
  if (found.candidates.empty()) found.near_miss = find_near_miss(library, measurement, options);
  return found;
}

Choice open_choices(const Identification& identification, const IdentifyOptions& options) {
  Choice choice;
  if (identification.candidates.empty()) return choice;
  const auto& best = identification.candidates.front().placements;
  const double limit = best.front().chi2 + options.told_apart_chi2;
  for (std::size_t i = 0; i < identification.candidates.size(); ++i) {
    if (identification.candidates[i].placements.front().chi2 <= limit) choice.parts.push_back(i);
  }
  for (std::size_t i = 0; i < best.size(); ++i) {
    if (best[i].same_space_as == i && best[i].chi2 <= limit) choice.placements.push_back(i);
    if (i > 0 && best[i].same_space_as == 0) ++choice.symmetric;
  }
  return choice;
}

std::vector<Alternative> alternatives_of(const Identification& identification) {
  std::vector<Alternative> all;
  const auto placement_of = [&](const Alternative& a) -> const Placement& {
    return identification.candidates[a.candidate].placements[a.placement];
  };
  for (std::size_t c = 0; c < identification.candidates.size(); ++c) {
    const auto& placements = identification.candidates[c].placements;
    for (std::size_t p = 0; p < placements.size(); ++p) {
      if (placements[p].fit && placements[p].same_space_as == p) all.push_back({c, p});
    }
  }
  std::stable_sort(all.begin(), all.end(), [&](const Alternative& a, const Alternative& b) {
    return placement_of(a).chi2 < placement_of(b).chi2;
  });
  return all;
}

std::optional<NextEdge> next_edge(const std::vector<PartModel>& library, const Measurement& measurement,
                                  const Identification& identification, const IdentifyOptions& options) {
  constexpr std::size_t kMaxCompared = 8;
  const Choice choice = open_choices(identification, options);
  std::vector<std::pair<const PartModel*, const NodeMap*>> alternatives;
  for (const std::size_t c : choice.parts) {
    const Candidate& candidate = identification.candidates[c];
    alternatives.emplace_back(&library[candidate.part], &candidate.placements.front().map);
  }
  for (std::size_t i = 1; i < choice.placements.size(); ++i) {
    const Candidate& best = identification.candidates.front();
    alternatives.emplace_back(&library[best.part], &best.placements[choice.placements[i]].map);
  }
  if (alternatives.size() < 2) return std::nullopt;
  alternatives.resize(std::min(alternatives.size(), kMaxCompared));
  std::optional<NextEdge> best;
  std::size_t most_told = 0;
  for (std::size_t node = 0; node < measurement.nodes.size(); ++node) {
    NextEdge edge{node, 1e9, {}};
    std::size_t told = 0;
    const double sigma_m = std::sqrt(2.0 / 3.0 * measurement.nodes[node].covariance_m2.trace());
    for (const auto& [part, map] : alternatives) {
      edge.lengths_m.push_back((*map)[node] == kNotMapped ? 0.0
                                                          : longest_open_edge_m(*part, *map, (*map)[node]));
      const double sigmas = std::abs(edge.lengths_m.back() - edge.lengths_m.front()) / sigma_m;
      if (edge.lengths_m.size() == 1 || sigmas < options.gate_sigmas) continue;
      ++told;
      edge.least_sigmas = std::min(edge.least_sigmas, sigmas);
    }
    if (told == 0 || edge.lengths_m.front() == 0 || told < most_told) continue;
    if (told == most_told && best && best->least_sigmas >= edge.least_sigmas) continue;
    most_told = told;
    best = edge;
  }
  return best;
}

}  // namespace phantom::survey
