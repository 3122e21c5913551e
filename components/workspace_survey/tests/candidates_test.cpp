// A person chooses among what agrees with a measurement (thesis A.2.3, A.3.3).
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/runtime/configuration/pose_text.hpp"
#include "components/workspace_survey/measurement_file.hpp"
#include "components/workspace_survey/page/candidates_page.hpp"
#include "components/workspace_survey/tests/rig.hpp"

namespace phantom::workspace_survey {
namespace {

using Json = nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

Json data_of(const std::string& page) {
  const std::string begins = "type=\"application/json\">";
  const auto from = page.find(begins) + begins.size();
  return Json::parse(page.substr(from, page.find("</script>", from) - from));
}

class Candidates : public InFolder {
 protected:
  struct Said {
    int exit_code;
    std::string text;
  };
  Said call(Request request, const std::string& typed = "") {
    std::istringstream in(typed);
    std::ostringstream print;
    if (request.library.empty()) request.library = source("deploy/parts");
    const int exit_code = run(request, shipped_config(), {}, in, print);
    return {exit_code, print.str()};
  }
  Request fit(const std::string& example) const {
    Request request;
    request.what = "fit";
    request.measurements = source("deploy/parts/measurements/" + example + ".csv");
    return request;
  }
  /// A library of one part, the cube under another name.
  Request of_library(const std::string& name, const std::string& more) {
    std::filesystem::copy_file(source("deploy/parts/stepped_block.obj"), folder_ / "part.obj",
                               std::filesystem::copy_options::overwrite_existing);
    write("library.yaml", "parts: [{name: '" + name + "', mesh: part.obj, mesh_scale: 0.001" + more + "}]\n");
    Request request = fit("refused_several_poses");
    request.library = folder_;
    request.page = folder_ / "page.html";
    return request;
  }
};

const geometry::Pose kTrue = runtime::parse_pose("0.1 -0.1 0.301 90 0 20").value();

TEST_F(Candidates, PosesThatFitAlikeAreShownAndAPersonPicksOne) {
  Request request = fit("refused_several_poses");
  request.page = folder_ / "page.html";
  const Said refused = call(request);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.text, AllOf(HasSubstr("alternatives, which a person may pick:\n   1  "),
                                  HasSubstr("  stepped_block"), HasSubstr("refused:")));
  const Json data = data_of(read(request.page));
  ASSERT_GE(data.at("cards").size(), 2U);
  EXPECT_EQ(data.at("pick"),
            "workspace_survey fit --measurements " + request.measurements.string() + " --pick ");
  int right = 0, number = 0;
  for (const Json& card : data.at("cards")) {
    const std::string name = data.at("parts").at(card.at("part").get<std::size_t>()).at("name");
    const survey::PartModel& part = shipped_library().models[find_part(shipped_library(), name)];
    Request picked = fit("refused_several_poses");
    picked.pick = card.at("number");
    picked.json = "-";
    EXPECT_EQ(picked.pick, static_cast<std::size_t>(++number)) << "the best first, numbered on";
    const Said said = call(picked);
    ASSERT_EQ(said.exit_code, 0) << said.text;
    const Json object = Json::parse(said.text).at("object");
    EXPECT_EQ(object.at("picked_among"), data.at("cards").size());
    geometry::Pose X_WO;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        X_WO.rotation(row, column) = card.at("rotation")[row][column];
      X_WO.translation_m[row] = card.at("shift")[row];
      EXPECT_NEAR(X_WO.translation_m[row], object.at("X_WO").at("xyz_m")[row].get<double>(), 1e-12)
          << "what is shown is what is fitted";
    }
    // Each explains what was measured: every measured corner lies on one of the model's.
    for (const Json& measured : data.at("measured")) {
      double nearest_m = 1.0;
      const Eigen::Vector3d p(measured.at("at")[0], measured.at("at")[1], measured.at("at")[2]);
      for (const auto& node : part.nodes_O_m) nearest_m = std::min(nearest_m, (X_WO * node - p).norm());
      EXPECT_LT(nearest_m, 0.01);
    }
    EXPECT_EQ(object.at("part"), name);
    right += name == "stepped_block" && survey::displacement_between_m(part, X_WO, kTrue) <=
                                            object.at("worst_displacement_m").get<double>();
  }
  EXPECT_EQ(right, 1) << "one is how it really stands";
}

// Tries workspace_survey: a number is picked that is none; a pick that errors do not explain
TEST_F(Candidates, AMissingNumberAndWhatErrorsDoNotExplainCannotBePicked) {
  Request request = fit("refused_several_poses");
  request.pick = 1000;
  const Said none = call(request);
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.text, HasSubstr("there is no alternative 1000; allowed: 1 to "));
  request = fit("refused_bad_range");
  request.pick = 1;
  EXPECT_EQ(call(request).exit_code, 1);
}

TEST_F(Candidates, APickIsHeldToTheSameLimitsAsWhatIsFoundAlone) {
  const Config config = shipped_config();
  const auto measurement = survey::register_nodes(
      config.head, config.errors,
      read_measurements(source("deploy/parts/measurements/refused_several_poses.csv")));
  ASSERT_TRUE(measurement);
  survey::SurveyOptions options = config.options;
  options.picked = 2;
  const auto picked = [&] { return survey::survey_object(shipped_library().models, *measurement, options); };
  EXPECT_TRUE(picked().object) << picked().refusal;
  options.least_fit_probability = 0.99999;
  EXPECT_FALSE(picked().object) << "errors alone do not explain it";
  EXPECT_THAT(picked().refusal, HasSubstr("more than their errors explain"));
  options = config.options;
  options.picked = 2;
  options.largest_displacement_m = 1e-4;
  EXPECT_FALSE(picked().object);
  EXPECT_THAT(picked().refusal, HasSubstr("known too badly"));
}

// Each space that an object may occupy once: 24 poses of a cube are one.
TEST_F(Candidates, SymmetricPosesAreOneAlternative) {
  Request request;
  request.what = "simulate", request.part = "cube", request.pose = "0.1 0 0.4 90 0 20";
  request.out = folder_ / "cube.csv";
  call(request);
  request = {};
  request.what = "fit", request.measurements = folder_ / "cube.csv", request.page = folder_ / "page.html";
  const Said said = call(request);
  EXPECT_EQ(said.exit_code, 0) << said.text;
  EXPECT_THAT(said.text, Not(HasSubstr("alternatives")));
  EXPECT_EQ(data_of(read(request.page)).at("cards").size(), 1U);
}

TEST_F(Candidates, PartsWithoutAPoseAreShownToBeRecognised) {
  const auto rows = read_measurements(source("deploy/parts/measurements/brick.csv"));
  std::ostringstream two;
  write_measurements(two, {{"A", false, "1", rows[0].reading, ""}, {"A", false, "2", rows[1].reading, ""}},
                     "an edge");
  Request request;
  request.what = "identify", request.measurements = write("edge.csv", two.str()),
  request.page = folder_ / "page.html";
  const Said said = call(request);
  EXPECT_EQ(said.exit_code, 0) << said.text;
  const Json data = data_of(read(request.page));
  ASSERT_GE(data.at("cards").size(), 1U);
  for (const Json& card : data.at("cards")) {
    EXPECT_EQ(card.at("number"), 0);
    EXPECT_THAT(card.at("text").get<std::string>(), HasSubstr("measure three corners"));
  }
}

// Tries workspace_survey: a picture for the page is missing; is neither PNG nor JPEG
TEST_F(Candidates, ThePageHoldsTheLibrarysPictureAndTheViewOfTheCell) {
  const std::string png = std::string("\x89PNG\r\n\x1a\n", 8) + "rest";
  write("seen.png", png);
  write("cell.jpg", "\xFF\xD8\xFF\xE0");
  Request request = of_library("block", ", image: seen.png");
  request.view = folder_ / "cell.jpg";
  call(request);
  const Json data = data_of(read(request.page));
  EXPECT_EQ(data.at("parts")[0].at("image"), "data:image/png;base64,iVBORw0KGgpyZXN0");
  EXPECT_EQ(data.at("view"), "data:image/jpeg;base64,/9j/4A==");
  EXPECT_THAT(refusal([&] {
                Request text = of_library("block", ", image: library.yaml");
                call(text);
              }),
              AllOf(HasSubstr("library.yaml"), HasSubstr("allowed: PNG or JPEG")));
  EXPECT_THROW(load_library(of_library("block", ", image: none.png").library), core::MissingError);
}

TEST_F(Candidates, WhereTheLibraryHasNoPictureOneIsMadeOfTheMesh) {
  Request request = of_library("block", "");
  call(request);
  const std::string image = data_of(read(request.page)).at("parts")[0].at("image");
  EXPECT_THAT(image, testing::StartsWith("data:image/png;base64,iVBORw0KGgo"));
  EXPECT_GT(image.size(), 5000U) << "not an empty one";
}

TEST_F(Candidates, NoNameEndsThePagesScript) {
  Request request = of_library("</script><b>", "");
  call(request);
  const std::string page = read(request.page);
  EXPECT_THAT(page, Not(HasSubstr("</script><b>")));
  EXPECT_EQ(data_of(page).at("parts")[0].at("name"), "</script><b>");
}

TEST_F(Candidates, AssistShowsThePageAfterAFaceAndTakesThePick) {
  Request request;
  request.what = "assist", request.part = "stepped_block", request.pose = "0.1 -0.1 0.301 90 0 20";
  request.faces = 1, request.seed = 5, request.page = folder_ / "page.html";
  const Said said = call(request, "pick 1\n" + std::string(12, '\n') + "pick\npick 2\nquit\n");
  EXPECT_THAT(said.text,
              AllOf(HasSubstr("no face is complete yet"), HasSubstr("alternatives, which a person may pick:"),
                    HasSubstr("page.html in a browser"), HasSubstr("needs a number of those listed"),
                    HasSubstr("picked by a person among")));
  EXPECT_EQ(said.exit_code, 0) << said.text;
  EXPECT_EQ(data_of(read(request.page)).at("pick"), "pick ");
}

}  // namespace
}  // namespace phantom::workspace_survey
