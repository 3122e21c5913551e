// The assistant steers a head by its driver's process: `workspace_survey assist --driver` over the shipped
// simulated head, which stands over the shipped cell with one part more. The test is the person who types.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <random>

#include "common/runtime/configuration/pose_text.hpp"
#include "components/workspace_survey/config.hpp"
#include "components/workspace_survey/library.hpp"
#include "components/workspace_survey/tests/survey_person.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/files.hpp"

namespace phantom::end_to_end {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr const char *kPart = "v_groove_block", *kPose = "0.1 0 0.4 90 0 20";
constexpr std::uint64_t kSeed = 5;

class SurveyHead : public testing::Test {
 protected:
  /// The shipped configuration, but a head that stands where it says: the test does not see its spot.
  std::filesystem::path config_file() const {
    std::string text =
        test::read_text(PHANTOM_SOURCE_DIR "/components/workspace_survey/workspace_survey.yaml");
    for (const char* key : {"pan_deg: 0.02", "tilt_deg: 0.02"}) {
      const auto at = text.find(key);
      EXPECT_NE(at, std::string::npos);
      text.insert(at + std::string(key).size() - 1, "0");
    }
    std::ofstream(folder_ / "survey.yaml") << text;
    return folder_ / "survey.yaml";
  }
  std::string line(const std::string& words) const {
    return PHANTOM_BIN_DIR "/workspace_survey " + words + " --config " + config_file().string();
  }
  test::Said assist(const std::string& driver, const std::string& typed, const std::string& more = "") const {
    std::ofstream(folder_ / "typed") << typed;
    std::ofstream(folder_ / "driver") << driver << '\n';
    return test::run_line(line("assist --driver 'sh " + (folder_ / "driver").string() + "' " + more) + " < " +
                          (folder_ / "typed").string());
  }
  std::string simulated_head() const {
    return "exec " + line(std::string("simulate_head --part ") + kPart + " --pose '" + kPose + "' --seed " +
                          std::to_string(kSeed));
  }

  const std::filesystem::path folder_ = test::new_folder();
};

TEST_F(SurveyHead, TheAssistantAimsMeasuresAndFits) {
  const auto config = workspace_survey::load_config(config_file());
  const auto library = workspace_survey::load_library(PHANTOM_SOURCE_DIR "/deploy/parts");
  const survey::PartModel& part = library.models[workspace_survey::find_part(library, kPart)];
  std::mt19937_64 random(~kSeed);
  const workspace_survey::SurveyPerson person{part, *runtime::parse_pose(kPose),
                                              survey::simulate_mounting(config.head, config.errors, random),
                                              config.errors};
  std::map<std::uint32_t, std::size_t> names;
  std::string typed;
  for (const auto& face : survey::visible_faces(part, person.X_WO, person.mounted.X_WH.translation_m))
    typed += person.face_lines(face, names);
  const auto file = (folder_ / "kept.csv").string();
  const test::Said said = assist(simulated_head(), typed + "save " + file + "\nquit\n");
  ASSERT_EQ(said.exit_code, 0) << said.output;
  EXPECT_THAT(said.output,
              AllOf(HasSubstr("Head: simulated head"), HasSubstr(std::string("part:        ") + kPart),
                    HasSubstr("A pose is found"), HasSubstr("the head's mounting alone")));
  EXPECT_EQ(test::run_line(line("fit --measurements " + file)).exit_code, 0)
      << "what was kept gives the same";
}

// Tries workspace_survey: the head's driver does not start … is not allowed
TEST_F(SurveyHead, ADriverThatCannotBeUsedIsNamed) {
  const test::Said silent = assist("exec sleep 60", "quit\n", "--driver-timeout-s 0.3");
  EXPECT_EQ(silent.exit_code, 3) << silent.output;
  EXPECT_THAT(silent.output, HasSubstr("describe: does not answer for 0.3 s"));
  const test::Said rubbish = assist("while read -r line; do echo hello; done", "quit\n");
  EXPECT_EQ(rubbish.exit_code, 2) << rubbish.output;
  EXPECT_THAT(rubbish.output, HasSubstr("'hello' is no JSON object"));
  const test::Said gone = assist(
      "read -r line; echo '{\"id\":1,\"contract\":1,\"driver\":\"d\",\"pan_rad\":[-1,1],"
      "\"tilt_rad\":[0,3]}'; exit 4",
      "aim 10 80\nhelp\nquit\n");
  EXPECT_EQ(gone.exit_code, 1) << gone.output;
  EXPECT_THAT(gone.output, AllOf(HasSubstr("aim: has ended with exit code 4"), HasSubstr("RANGE PAN TILT")))
      << "the dialogue goes on, for readings that are typed";
}

}  // namespace
}  // namespace phantom::end_to_end
