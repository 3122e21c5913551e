#include "common/core/units.hpp"
#include "components/workspace_survey/tests/rig.hpp"

namespace phantom::workspace_survey {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class ConfigTest : public InFolder {
 protected:
  std::string with(const std::string& from, const std::string& to) const {
    std::string text = read(source("components/workspace_survey/workspace_survey.yaml"));
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    const auto file = write("odd.yaml", text.replace(at, from.size(), to));
    return refusal([&] { load_config(file); });
  }
};

TEST_F(ConfigTest, TheShippedOneIsTheThesissInstrument) {
  const Config config = shipped_config();
  EXPECT_NEAR(config.errors.range_m, 0.0025, 1e-12);
  EXPECT_NEAR(config.head.beam_offset_m, 0.06, 1e-12);
  EXPECT_NEAR(survey::spot_radius_m(config.errors, 3.5), 0.001025, 1e-12);
  EXPECT_NEAR(config.errors.mounting_m, 0.001, 1e-12);
  EXPECT_NEAR(config.errors.mounting_rad, 0.05 * core::kRadPerDegree, 1e-12);
  EXPECT_EQ(config.errors.law, survey::ErrorLaw::kUniform);
  EXPECT_NEAR(config.options.largest_displacement_m, 0.02, 1e-12);
}

TEST_F(ConfigTest, FaultsAreNamed) {
  EXPECT_THAT(with("range_mm: 2.5", "range_mm: 0"),
              AllOf(HasSubstr("odd.yaml:"), HasSubstr("errors.range_mm"), HasSubstr("0.01 to 1000 mm")));
  EXPECT_THAT(with("mounting_deg: 0.05", "mounting_deg: 90"), HasSubstr("0 to 10 deg"));
  EXPECT_THAT(with("spot_mm: 0.5", "spot_mm: -1"), HasSubstr("0 to 100 mm"));
  EXPECT_THAT(with("law: uniform", "law: triangular"),
              AllOf(HasSubstr("law"), HasSubstr("uniform, normal, extreme")));
  EXPECT_THAT(with("confidence: 0.99", "confidence: 99"), HasSubstr("confidence"));
  EXPECT_THAT(with("max_range_m: 10", "max_range_m: 0.1"), HasSubstr("max_range_m"));
  EXPECT_THAT(with("pan_deg: 0.02", "pan_degrees: 0.02"), HasSubstr("pan_deg"));
}

}  // namespace
}  // namespace phantom::workspace_survey
