// Graphs of links and joints as strangers draw them: trees, closed loops, two parents, islands.
#include "common/robot/kinematics/link_tree.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/robot/tests/test_arms.hpp"

namespace phantom::robot {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(LinkTree, NamesWhatIsWrong) {
  const std::vector<std::string> links{"base", "l1", "l2", "tool"};
  const LinkEdge j1{"j1", "base", "l1"}, j2{"j2", "l1", "l2"}, end{"end", "l2", "tool"};
  EXPECT_THAT(fault_of_link_tree(links, {j1, j2, end}), IsEmpty());
  EXPECT_EQ(fault_of_link_tree(links, {j1, j2, end, {"k", "l2", "l2"}}),
            "joint 'k' leads from link 'l2' to itself");
  EXPECT_EQ(fault_of_link_tree(links, {j1, j2, end, {"rod", "base", "l2"}}),
            "link 'l2' has two parents: 'l1' by joint 'j2' and 'base' by joint 'rod'");
  EXPECT_EQ(fault_of_link_tree(links, {j1, {"a", "tool", "l2"}, end}),
            "links 'l2', 'tool' form a closed loop, by the joints 'a', 'end'");
  EXPECT_EQ(fault_of_link_tree(links, {j1, end}), "more than one link has no parent: 'base', 'l2'");
  EXPECT_EQ(fault_of_link_tree({}, {}), "there is no link");
  EXPECT_THAT(fault_of_link_tree({"base"}, {}), IsEmpty());
}

struct Graph {
  std::vector<std::string> links;
  std::vector<LinkEdge> joints;
};

/// A tree whose names have no order, and up to two changes: a joint more, one that is led elsewhere, one
/// less.
Graph random_graph(std::mt19937& random) {
  const auto below = [&random](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  Graph graph;
  const std::size_t count = 2 + below(7);
  for (std::size_t i = 0; i < count; ++i) graph.links.push_back("l" + std::to_string(i));
  std::ranges::shuffle(graph.links, random);
  std::vector<int> numbers(count + 2);
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<int>(i);
  std::ranges::shuffle(numbers, random);
  const auto name = [&] { return "j" + std::to_string(numbers[graph.joints.size()]); };
  for (std::size_t i = 1; i < count; ++i)
    graph.joints.push_back({name(), graph.links[below(i)], graph.links[i]});
  for (std::size_t change = below(3); change > 0; --change) {
    const std::string& any = graph.links[below(count)];
    switch (below(4)) {
      case 0:
        graph.joints.push_back({name(), any, graph.links[below(count)]});
        break;
      case 1:
        graph.joints[below(graph.joints.size())].parent = any;
        break;
      case 2:
        graph.joints[below(graph.joints.size())].child = any;
        break;
      default:
        graph.joints.pop_back();
    }
    if (graph.joints.empty()) break;
  }
  return graph;
}

/// A tree by its definition: one joint fewer than links, and from one link every other one is reached.
bool is_tree(const Graph& graph) {
  if (graph.joints.size() + 1 != graph.links.size()) return false;
  return std::ranges::any_of(graph.links, [&](const std::string& root) {
    std::vector<std::string> reached{root};
    for (std::size_t round = 0; round < graph.links.size(); ++round) {
      for (const LinkEdge& edge : graph.joints) {
        if (std::ranges::count(reached, edge.parent) && !std::ranges::count(reached, edge.child))
          reached.push_back(edge.child);
      }
    }
    return reached.size() == graph.links.size();
  });
}

/// Counts the joints from `tip` up to the root.
std::size_t joints_above(const Graph& graph, const std::string& tip) {
  std::size_t steps = 0;
  for (auto edge = std::ranges::find(graph.joints, tip, &LinkEdge::child); edge != graph.joints.end();
       ++steps)
    edge = std::ranges::find(graph.joints, edge->parent, &LinkEdge::child);
  return steps;
}

TEST(LinkTree, AgreesWithTheDefinitionOnRandomGraphs) {
  std::mt19937 random(4);
  int trees = 0, others = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const Graph graph = random_graph(random);
    const std::string fault = fault_of_link_tree(graph.links, graph.joints);
    ASSERT_EQ(fault.empty(), is_tree(graph)) << fault;
    ++(fault.empty() ? trees : others);
  }
  EXPECT_GT(trees, 1000);
  EXPECT_GT(others, 1000);
}

std::string urdf_of(const Graph& graph) {
  std::string body;
  for (const std::string& link : graph.links) body += "<link name=\"" + link + "\"/>";
  for (const LinkEdge& edge : graph.joints) {
    body += test_arms::moving_joint(edge.joint, "revolute", edge.parent, edge.child, "0 0 1", "0 0 0",
                                    "0 1 0", 1);
  }
  return body;
}

TEST(LinkTree, AUrdfIsReadWholeOrRefusedWithTheNamesOfLinks) {
  std::mt19937 random(5);
  int read = 0, refused = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    const Graph graph = random_graph(random);
    const std::string tip = graph.links.back();
    const auto arm = SerialArm::from_urdf(test_arms::write_urdf(urdf_of(graph)), tip, {});
    const std::string message = arm ? "" : arm.status().message();
    SCOPED_TRACE(message);
    if (!is_tree(graph)) {
      ASSERT_FALSE(arm);
      ASSERT_THAT(message, testing::AnyOf(HasSubstr("a URDF is a tree"), HasSubstr("Two root links found")));
      ASSERT_TRUE(std::ranges::any_of(graph.links, [&](const std::string& link) {
        return message.find("'" + link + "'") != std::string::npos ||
               message.find("[" + link + "]") != std::string::npos;
      }));
      ++refused;
      continue;
    }
    const std::size_t steps = joints_above(graph, tip);
    if (steps == 0) continue;  // the tip is the root: no joint moves
    ASSERT_TRUE(arm);
    ASSERT_EQ(arm->joint_count(), steps);
    std::size_t frames = 0;
    for (const Link& link : arm->links()) frames += link.frames.size();
    ASSERT_EQ(frames, graph.links.size());
    ++read;
  }
  EXPECT_GT(read, 300);
  EXPECT_GT(refused, 300);
}

// More links in a row than there is room on a stack for calls.
TEST(LinkTree, ABranchMayBeOfAnyDepth) {
  constexpr int kDepth = 30'000;
  std::string body = R"(<link name="base"/><link name="tip"/>)" +
                     test_arms::moving_joint("turn", "revolute", "base", "tip", "0 0 0", "0 0 0", "0 0 1", 1);
  std::string parent = "tip";
  for (int i = 0; i < kDepth; ++i) {
    const std::string name = std::to_string(kDepth - i);
    body += "<link name=\"" + name + "\"/><joint name=\"j" + name + "\" type=\"fixed\"><parent link=\"" +
            parent + "\"/><child link=\"" + name + R"("/><origin xyz="0.001 0 0"/></joint>)";
    parent = name;
  }
  const auto arm = SerialArm::from_urdf(test_arms::write_urdf(body), "tip", {});
  ASSERT_TRUE(arm) << arm.status().message();
  EXPECT_NEAR(arm->find_frame("1")->second.translation_m.x(), 0.001 * kDepth, 1e-6);
}

}  // namespace
}  // namespace phantom::robot
