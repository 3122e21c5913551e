#include "common/robot/kinematics/link_tree.hpp"

#include <map>
#include <set>

#include "common/core/text.hpp"

namespace phantom::robot {
namespace {

/// The edge to each link that has one. Returns the first fault in `fault`.
std::map<std::string, const LinkEdge*> parents_of(const std::vector<LinkEdge>& joints, std::string& fault) {
  std::map<std::string, const LinkEdge*> edge_to;
  for (const LinkEdge& edge : joints) {
    if (edge.parent == edge.child) {
      fault = "joint '" + edge.joint + "' leads from link '" + edge.child + "' to itself";
      return {};
    }
    const auto [known, is_new] = edge_to.emplace(edge.child, &edge);
    if (is_new) continue;
    const LinkEdge& other = *known->second;
    fault = "link '" + edge.child + "' has two parents: '" + other.parent + "' by joint '" + other.joint +
            "' and '" + edge.parent + "' by joint '" + edge.joint + "'";
    return {};
  }
  return edge_to;
}

/// Returns the cycle that the way up from `link` ends in, as a fault; empty if it ends at a root or at a link
/// of `sound`. Adds its links to `sound`.
std::string cycle_above(const std::string& link, const std::map<std::string, const LinkEdge*>& edge_to,
                        std::set<std::string>& sound) {
  std::set<std::string> way;
  std::string at = link;
  while (!sound.contains(at)) {
    way.insert(at);
    const auto up = edge_to.find(at);
    if (up == edge_to.end()) break;
    at = up->second->parent;
    if (!way.contains(at)) continue;
    std::string names = "'" + at + "'", by;
    for (std::string step = at;; step = edge_to.at(step)->parent) {
      core::add_to_list(by, "'" + edge_to.at(step)->joint + "'");
      if (edge_to.at(step)->parent == at) break;
      names += ", '" + edge_to.at(step)->parent + "'";
    }
    return "links " + names + " form a closed loop, by the joints " + by;
  }
  sound.merge(way);
  return {};
}

}  // namespace

std::string fault_of_link_tree(const std::vector<std::string>& links, const std::vector<LinkEdge>& joints) {
  std::string fault;
  const auto edge_to = parents_of(joints, fault);
  if (!fault.empty()) return fault;
  std::set<std::string> sound;
  for (const std::string& link : links) {
    if (fault = cycle_above(link, edge_to, sound); !fault.empty()) return fault;
  }
  std::string roots;
  int count = 0;
  for (const std::string& link : links) {
    if (!edge_to.contains(link)) core::add_to_list(roots, "'" + link + "'"), ++count;
  }
  if (count == 1) return {};
  return count == 0 ? "there is no link" : "more than one link has no parent: " + roots;
}

}  // namespace phantom::robot
