#include "components/phantom_session/first_start.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <sstream>

#include "common/core/errors.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/configuration/deployment.hpp"

namespace phantom::phantom_session {
namespace {

namespace fs = std::filesystem;
const fs::path kDeploy = PHANTOM_SOURCE_DIR "/deploy";

class FirstStart : public ::testing::Test {
 protected:
  FirstStart() { fs::remove_all(folder_); }
  ~FirstStart() override { fs::remove_all(folder_); }

  const fs::path folder_ = fs::temp_directory_path() / ("phantom_first_start_" + std::to_string(getpid()));
};

FirstAnswer answer_to(const std::string& typed, std::string* asked = nullptr) {
  std::istringstream in(typed);
  std::ostringstream out;
  const FirstAnswer answer = ask_first_start(in, out);
  if (asked != nullptr) *asked = out.str();
  return answer;
}

TEST_F(FirstStart, OffersTheDemoACellAndAnArmOfOnesOwn) {
  std::string asked;
  EXPECT_EQ(answer_to("\n", &asked).beginning, Beginning::kDemo);
  EXPECT_THAT(asked, testing::AllOf(testing::HasSubstr("the demo"), testing::HasSubstr("a cell of your own"),
                                    testing::HasSubstr("an arm of your own")));
  EXPECT_EQ(answer_to("1\n").beginning, Beginning::kDemo);
  EXPECT_EQ(answer_to("").beginning, Beginning::kDemo) << "nobody answers";
  const FirstAnswer cell = answer_to("what?\n4\n2\n\n", &asked);
  EXPECT_EQ(cell.beginning, Beginning::kOwnCell);
  EXPECT_EQ(cell.folder, "my_cell");
  EXPECT_NE(asked.find("1, 2 or 3"), asked.rfind("1, 2 or 3")) << "asked again until there is an answer";
  const FirstAnswer arm = answer_to("3\n/tmp/lab arm\n");
  EXPECT_EQ(arm.beginning, Beginning::kOwnArm);
  EXPECT_EQ(arm.folder, "/tmp/lab arm");
}

// For both: what is copied is read and checked as the components do.
TEST_F(FirstStart, WhatIsBegunIsWholeAndRunsAsItIs) {
  for (const Beginning beginning : {Beginning::kOwnCell, Beginning::kOwnArm}) {
    fs::remove_all(folder_);
    const std::string next = begin_own(beginning, folder_, kDeploy);
    runtime::ProcessOptions options;
    options.component = "wva_server";
    options.deployment = folder_ / "topology.yaml";
    EXPECT_THAT(next, testing::HasSubstr("phantom_session --deployment " + options.deployment.string()));
    const runtime::Deployment deployment = runtime::load_deployment(options);
    EXPECT_EQ(fs::canonical(deployment.cell), fs::canonical(folder_ / "cell.yaml"));
    EXPECT_TRUE(fs::exists(deployment.network.qos_profiles));
    const runtime::CellConfig cell = runtime::load_checked_cell(deployment.cell);
    EXPECT_GT(runtime::load_arm(cell.arm()).joint_count(), 0U);
    for (const auto& process : deployment.hosts.at(0).processes) {
      if (!process.config.empty()) {
        EXPECT_EQ(fs::canonical(process.config.parent_path()), fs::canonical(folder_));
      }
    }
    EXPECT_TRUE(fs::exists(folder_ / "reaches.yaml"));
    EXPECT_FALSE(fs::exists(folder_ / "cad"));
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      if (entry.path().extension() != ".yaml") continue;
      std::ifstream file(entry.path());
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      EXPECT_EQ(text.find("../"), std::string::npos) << entry.path() << " needs something beyond the folder";
    }
  }
}

TEST_F(FirstStart, NothingThatIsThereIsTouched) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "mine.txt") << "mine";
  EXPECT_THROW(begin_own(Beginning::kOwnCell, folder_, kDeploy), core::ConfigError);
  EXPECT_THROW(begin_own(Beginning::kOwnCell, folder_ / "mine.txt", kDeploy), core::ConfigError);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
  EXPECT_THROW(begin_own(Beginning::kOwnCell, folder_ / "new", folder_ / "no_deploy"), core::MissingError);
}

}  // namespace
}  // namespace phantom::phantom_session
