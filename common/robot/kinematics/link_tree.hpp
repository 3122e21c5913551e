#pragma once

#include <string>
#include <vector>

namespace phantom::robot {

/// A joint as an edge of the graph of links.
struct LinkEdge {
  std::string joint, parent, child;  ///< names; both links are among those of the graph
};

/// Returns why these links and joints are not one tree, naming the links and joints; empty if they are: one
/// root, one joint to every other link, every link below the root. Needs neither recursion nor a root, so
/// that any graph may come. Pure; not real-time safe.
std::string fault_of_link_tree(const std::vector<std::string>& links, const std::vector<LinkEdge>& joints);

}  // namespace phantom::robot
