#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/survey/fit.hpp"

namespace phantom::survey {

struct IdentifyOptions {
  double gate_sigmas = 4.0;         ///< a length may differ by this many standard deviations …
  double tolerance_m = 0.0005;      ///< … plus the difference between the real part and its model
  double least_probability = 1e-5;  ///< least probability of a fit for a part to become a candidate
  /// Fits whose chi² differs by less count as equally good (likelihoods 400 to 1).
  double told_apart_chi2 = 12.0;
  std::size_t most_placements = 5000;  ///< for each part
  std::size_t most_partial = 50'000;   ///< for each part, while features are combined
};

/// One way in which the measured nodes can be assigned to nodes of a part.
struct Placement {
  NodeMap map;
  std::optional<PoseFit> fit;  ///< none while the nodes do not determine a pose
  double worst_sigmas = 0.0;   ///< greatest departure of a length from the part's, in standard deviations
  double chi2 = 0.0;           ///< of the fit; without a fit, of the edges' lengths
  /// First placement of this part that occupies the same space. It is this one itself, unless a symmetry of
  /// the part maps one to the other.
  std::size_t same_space_as = 0;
};

/// A part of the library that agrees with everything measured.
struct Candidate {
  std::size_t part = 0;               ///< index into the library
  std::vector<Placement> placements;  ///< the best first
  bool all_found = true;              ///< false: there are more placements than the options allow to keep
};

/// The part that comes nearest, when no part agrees.
struct NearMiss {
  std::size_t part = 0;
  Placement placement;                 ///< how the nodes would be assigned to the part
  std::size_t node_a = 0, node_b = 0;  ///< the pair of nodes whose distance differs most
  double measured_m = 0.0, modelled_m = 0.0, sigmas = 0.0;
};

struct Identification {
  std::vector<Candidate> candidates;  ///< ranked by agreement, the best first
  std::optional<NearMiss> near_miss;  ///< if there are no candidates and a part comes near
};

/// Searches the features of the library's parts for the measured ones (A.1, A.2.4). Closed faces are compared
/// by their whole border, and parts of borders (an edge, a corner …) by successive corners. All features
/// together are compared by the distances between all nodes, and by the side from which a face is seen.
/// Adding a face to a measurement, after the others, never gives more candidates. Pure.
Identification identify(const std::vector<PartModel>& library, const Measurement& measurement,
                        const IdentifyOptions& options = {});

/// What the identification leaves undecided.
struct Choice {
  /// Candidates that fit as well as the best, as indices into Identification::candidates.
  std::vector<std::size_t> parts;
  /// Placements of the best candidate: one for each space that it may occupy, the best first.
  std::vector<std::size_t> placements;
  std::size_t symmetric = 1;  ///< number of placements that occupy the same space as the best, including it
};
Choice open_choices(const Identification& identification, const IdentifyOptions& options = {});

/// A candidate and one of its placements.
struct Alternative {
  std::size_t candidate = 0, placement = 0;
};
/// Returns what agrees with a measurement and has a pose, one for each space that it would occupy, the best
/// match first: what a person may choose from (A.2.3a).
std::vector<Alternative> alternatives_of(const Identification& identification);

/// An edge to measure next: its length would distinguish candidates or placements.
struct NextEdge {
  std::size_t node = 0;           ///< measured node at which it starts
  double least_sigmas = 0.0;      ///< least difference of the lengths, in standard deviations
  std::vector<double> lengths_m;  ///< one for each of the first alternatives compared
};
/// Searches the unmeasured edges at measured nodes. Returns none if no single edge would help.
std::optional<NextEdge> next_edge(const std::vector<PartModel>& library, const Measurement& measurement,
                                  const Identification& identification, const IdentifyOptions& options = {});

}  // namespace phantom::survey
