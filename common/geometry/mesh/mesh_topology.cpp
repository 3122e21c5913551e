#include "common/geometry/mesh/mesh_topology.hpp"

#include <algorithm>
#include <utility>

namespace phantom::geometry {
namespace {

std::uint64_t edge_name(std::uint32_t a, std::uint32_t b) {
  return (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
}

/// One triangle's use of an edge.
struct EdgeUse {
  std::uint64_t edge;
  std::uint32_t triangle;
  bool upwards;  ///< from the lower to the higher vertex
};

std::vector<EdgeUse> sorted_edges(std::span<const Triangle> triangles) {
  std::vector<EdgeUse> uses;
  uses.reserve(3 * triangles.size());
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[i][k], b = triangles[i][(k + 1) % 3];
      uses.push_back({edge_name(a, b), i, a < b});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.triangle < b.triangle;
  });
  return uses;
}

struct Neighbour {
  std::uint32_t triangle = UINT32_MAX;
  bool same_way = false;  ///< both have the same orientation without turning one over
};

/// Finds neighbours across manifold edges, three slots per triangle; counts the other edges.
std::vector<std::array<Neighbour, 3>> neighbours(std::span<const Triangle> triangles, MeshTopology& topology,
                                                 std::vector<std::uint8_t>& at_rim) {
  std::vector<std::array<Neighbour, 3>> all(triangles.size());
  std::vector<std::uint8_t> used(triangles.size(), 0);
  const std::vector<EdgeUse> uses = sorted_edges(triangles);
  for (std::size_t from = 0, to = 0; from < uses.size(); from = to) {
    while (to < uses.size() && uses[to].edge == uses[from].edge) ++to;
    if (to - from == 2) {
      const EdgeUse &a = uses[from], &b = uses[from + 1];
      const bool same_way = a.upwards != b.upwards;
      all[a.triangle][used[a.triangle]++] = {b.triangle, same_way};
      all[b.triangle][used[b.triangle]++] = {a.triangle, same_way};
      continue;
    }
    ++(to - from == 1 ? topology.open_edges : topology.non_manifold_edges);
    for (std::size_t i = from; i < to; ++i) at_rim[uses[i].triangle] = 1;
  }
  return all;
}

std::size_t odd_edges(std::span<const Triangle> triangles) {
  const std::vector<EdgeUse> uses = sorted_edges(triangles);
  std::size_t odd = 0;
  for (std::size_t from = 0, to = 0; from < uses.size(); from = to) {
    while (to < uses.size() && uses[to].edge == uses[from].edge) ++to;
    odd += (to - from) % 2;
  }
  return odd;
}

/// Returns the corners in rising order, and whether that is an odd permutation.
std::pair<Triangle, bool> sorted_corners(Triangle t) {
  bool odd = false;
  const auto order = [&](std::size_t i, std::size_t j) {
    if (t[i] > t[j]) {
      std::swap(t[i], t[j]);
      odd = !odd;
    }
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);
  return {t, odd};
}

}  // namespace

MeshTopology topology_of(std::span<const Triangle> triangles) {
  MeshTopology topology;
  std::vector<std::uint8_t> at_rim(triangles.size(), 0);
  const auto beside = neighbours(triangles, topology, at_rim);
  topology.shell_of.assign(triangles.size(), UINT32_MAX);
  topology.turned.assign(triangles.size(), 0);
  std::vector<std::uint32_t> members;
  for (std::uint32_t seed = 0; seed < triangles.size(); ++seed) {
    if (topology.shell_of[seed] != UINT32_MAX) continue;
    const auto name = static_cast<std::uint32_t>(topology.shells.size());
    MeshTopology::Shell shell;
    members.assign(1, seed);
    topology.shell_of[seed] = name;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const std::uint32_t here = members[i];
      shell.closed = shell.closed && at_rim[here] == 0;
      shell.turned += topology.turned[here];
      for (const Neighbour& next : beside[here]) {
        if (next.triangle == UINT32_MAX) continue;
        const auto turned = static_cast<std::uint8_t>(topology.turned[here] ^ (next.same_way ? 0 : 1));
        if (topology.shell_of[next.triangle] == UINT32_MAX) {
          topology.shell_of[next.triangle] = name;
          topology.turned[next.triangle] = turned;
          members.push_back(next.triangle);
        } else {
          shell.orientable = shell.orientable && topology.turned[next.triangle] == turned;
        }
      }
    }
    shell.triangles = members.size();
    if (2 * shell.turned > shell.triangles) {  // most are turned: turn the others instead
      shell.turned = shell.triangles - shell.turned;
      for (const std::uint32_t i : members) topology.turned[i] ^= 1;
    }
    topology.shells.push_back(shell);
  }
  return topology;
}

UniqueTriangles unique_triangles(std::span<const Triangle> triangles) {
  struct Named {
    Triangle corners;
    bool odd;
    std::uint32_t source;
  };
  UniqueTriangles unique;
  std::vector<Named> named;
  named.reserve(triangles.size());
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const auto [corners, odd] = sorted_corners(triangles[i]);
    if (corners[0] == corners[1] || corners[1] == corners[2]) {
      ++unique.degenerate;
    } else {
      named.push_back({corners, odd, i});
    }
  }
  std::sort(named.begin(), named.end(), [](const Named& a, const Named& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.source < b.source;
  });
  std::vector<std::uint32_t> kept, facing_back;  // facing_back: the reverse side of a kept triangle
  for (std::size_t from = 0, to = 0; from < named.size(); from = to) {
    bool has_back = false;
    kept.push_back(named[from].source);
    for (; to < named.size() && named[to].corners == named[from].corners; ++to) {
      if (has_back || named[to].odd == named[from].odd) continue;
      facing_back.push_back(named[to].source);
      has_back = true;
    }
  }
  unique.duplicates = named.size() - kept.size();
  const auto gather = [&](std::vector<std::uint32_t> sources) {
    std::sort(sources.begin(), sources.end());
    unique.source = std::move(sources);
    unique.triangles.clear();
    for (const std::uint32_t i : unique.source) unique.triangles.push_back(triangles[i]);
  };
  gather(kept);
  if (facing_back.empty()) return unique;
  const std::size_t odd_without = odd_edges(unique.triangles);
  std::vector<std::uint32_t> both = kept;
  both.insert(both.end(), facing_back.begin(), facing_back.end());
  gather(both);
  if (odd_edges(unique.triangles) < odd_without) {
    unique.duplicates -= facing_back.size();
  } else {
    gather(kept);
  }
  return unique;
}

}  // namespace phantom::geometry
