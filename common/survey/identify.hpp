#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/survey/fit.hpp"

namespace phantom::survey {

struct IdentifyOptions {
  double gate_sigmas = 4.0;         ///< a length may depart by so many standard deviations …
  double tolerance_m = 0.0005;      ///< … and by what the real part may differ from its model
  double least_probability = 1e-5;  ///< of a fit, to be a candidate at all
  double told_apart_chi2 =
      12.0;  ///< fits that differ by less are as good as each other (likelihoods 400 to 1)
  std::size_t most_placements = 5000;  ///< per part
  std::size_t most_partial = 50'000;   ///< per part, while features are put together
};

/// One way in which the measured nodes can be nodes of a part.
struct Placement {
  NodeMap map;
  std::optional<PoseFit> fit;     ///< none while the nodes do not determine a pose
  double worst_sigmas = 0.0;      ///< the length that departs most from the part's, in standard deviations
  double chi2 = 0.0;              ///< of the fit; without one, of the edges' lengths
  std::size_t same_space_as = 0;  ///< the first placement of this part that occupies the same space: itself,
                                  ///< unless a symmetry of the part takes one into the other
};

/// A part of the library that agrees with all that was measured.
struct Candidate {
  std::size_t part = 0;               ///< index into the library
  std::vector<Placement> placements;  ///< the best first
  bool all_found = true;              ///< false: there are more than the options allow to keep
};

/// The nearest miss, where nothing agrees.
struct NearMiss {
  std::size_t part = 0;
  Placement placement;                 ///< how the nodes would be the part's
  std::size_t node_a = 0, node_b = 0;  ///< whose distance departs most
  double measured_m = 0.0, modelled_m = 0.0, sigmas = 0.0;
};

struct Identification {
  std::vector<Candidate> candidates;  ///< ranked by agreement, the best first
  std::optional<NearMiss> near_miss;  ///< if there are no candidates and anything comes near
};

/// Looks for what was measured among the features of the library's parts (A.1, A.2.4): faces by their whole
/// border, parts of borders (an edge, a corner …) by successive corners, all of them together by the
/// distances between all nodes and by the side from which a face is seen. A measurement with one face more
/// (after the others) never gets more candidates. Pure.
Identification identify(const std::vector<PartModel>& library, const Measurement& measurement,
                        const IdentifyOptions& options = {});

/// What the identification leaves open.
struct Choice {
  std::vector<std::size_t> parts;  ///< indices into Identification::candidates that fit as well as the best
  std::vector<std::size_t>
      placements;             ///< of the best candidate: one for each space it may occupy, the best first
  std::size_t symmetric = 1;  ///< placements that occupy the same space as the best, it included
};
Choice open_choices(const Identification& identification, const IdentifyOptions& options = {});

/// An edge whose measurement would tell candidates (or placements) apart.
struct NextEdge {
  std::size_t node = 0;           ///< measured node that it starts from
  double least_sigmas = 0.0;      ///< by how much the lengths differ at least
  std::vector<double> lengths_m;  ///< one for each of the first alternatives that were compared
};
/// Looks among the edges that leave measured nodes and were not measured; none if no single edge would help.
std::optional<NextEdge> next_edge(const std::vector<PartModel>& library, const Measurement& measurement,
                                  const Identification& identification, const IdentifyOptions& options = {});

}  // namespace phantom::survey
