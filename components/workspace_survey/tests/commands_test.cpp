#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "common/core/units.hpp"
#include "components/workspace_survey/assist.hpp"
#include "components/workspace_survey/measurement_file.hpp"
#include "components/workspace_survey/tests/rig.hpp"

namespace phantom::workspace_survey {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Commands : public InFolder {
 protected:
  struct Said {
    int exit_code;
    std::string text;
  };
  Said call(const Request& request, const std::string& typed = "") {
    std::istringstream in(typed);
    std::ostringstream print;
    Request whole = request;
    if (whole.library.empty()) whole.library = source("deploy/parts");
    const int exit_code = run(whole, shipped_config(), workspace_, in, print);
    return {exit_code, print.str()};
  }
  Request fit(const std::filesystem::path& file) const {
    Request request;
    request.what = "fit";
    request.measurements = file;
    return request;
  }
  Request simulate(const std::string& part, const std::string& pose) const {
    Request request;
    request.what = "simulate";
    request.part = part;
    request.pose = pose;
    return request;
  }

  Workspace workspace_ = {};
};

TEST_F(Commands, PartsAreListedAndTheirPicturesWritten) {
  Request request;
  request.what = "parts";
  request.out = folder_ / "pictures";
  const Said said = call(request);
  EXPECT_EQ(said.exit_code, 0);
  EXPECT_THAT(said.text, AllOf(HasSubstr("\nbar "), HasSubstr("pictures: 9 pictures\n")));
  for (const LibraryPart& part : shipped_library().parts)
    EXPECT_FALSE(cv::imread((request.out / (part.name + ".png")).string()).empty()) << part.name;
  request.out = write("a_file", "");
  EXPECT_THAT(refusal([&] { call(request); }), HasSubstr("a_file/v_groove_block.png: cannot be written"));
  std::filesystem::copy_file(source("deploy/parts/cube.obj"), folder_ / "cube.obj");
  write("library.yaml", "parts: [{name: ../cube, mesh: cube.obj, mesh_scale: 0.001}]\n");
  request.library = folder_;
  request.out = folder_ / "inner";
  EXPECT_THAT(refusal([&] { call(request); }), HasSubstr("allowed: a name without '/'"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "cube.png"));
}

/// The pose that a shipped example's comment states.
geometry::Pose stated(const std::string& text) {
  const auto from = text.find('"') + 1;
  std::istringstream numbers(text.substr(from, text.find('"', from) - from));
  double x, y, z, roll, pitch, yaw;
  numbers >> x >> y >> z >> roll >> pitch >> yaw;
  return {geometry::rotation_from_rpy(roll * core::kRadPerDegree, pitch * core::kRadPerDegree,
                                      yaw * core::kRadPerDegree),
          {x, y, z}};
}

TEST_F(Commands, EveryShippedExampleIsFittedWithinWhatItStatesOrRefusedAsItsNameSays) {
  int fitted = 0, refused = 0;
  for (const auto& entry : std::filesystem::directory_iterator(source("deploy/parts/measurements"))) {
    Request request = fit(entry.path());
    request.json = "-";
    const Said said = call(request);
    const auto json = nlohmann::json::parse(said.text);
    const std::string name = entry.path().stem().string();
    if (name.starts_with("refused_")) {
      EXPECT_EQ(said.exit_code, 1) << name;
      EXPECT_FALSE(json.at("accepted").get<bool>()) << name;
      EXPECT_FALSE(json.at("advice").empty()) << name;
      ++refused;
      continue;
    }
    ASSERT_EQ(said.exit_code, 0) << name << said.text;
    const auto& object = json.at("object");
    EXPECT_EQ(object.at("part"), name);
    const survey::PartModel& part = shipped_library().models[find_part(shipped_library(), name)];
    const auto p = object.at("X_WO").at("xyz_m").get<std::vector<double>>();
    const auto q = object.at("X_WO").at("quaternion_xyzw").get<std::vector<double>>();
    const geometry::Pose X_WO{geometry::rotation_from_quaternion({q[0], q[1], q[2], q[3]}),
                              {p[0], p[1], p[2]}};
    if (object.at("symmetric_poses") == 1) {
      EXPECT_LE(survey::displacement_between_m(part, X_WO, stated(read(entry.path()))),
                object.at("worst_displacement_m").get<double>())
          << name;
    }
    EXPECT_EQ(
        object.at("guard_vox").get<int>(),
        survey::guard_voxels(object.at("worst_displacement_m"), object.at("voxel_size_m").get<double>()));
    ++fitted;
  }
  EXPECT_GE(fitted, 4);
  EXPECT_GE(refused, 2);
}

TEST_F(Commands, SimulateFitAndPictureWorkTogether) {
  Request request = simulate("wedge", "0.1 0 0.4 90 0 20");
  request.out = folder_ / "wedge.csv";
  EXPECT_EQ(call(request).exit_code, 0);
  request = fit(folder_ / "wedge.csv");
  request.picture = folder_ / "wedge.png";
  request.json = folder_ / "wedge.json";
  const Said said = call(request);
  EXPECT_EQ(said.exit_code, 0) << said.text;
  EXPECT_THAT(said.text, AllOf(HasSubstr("candidates: 1 of 9 parts"), HasSubstr("part:        wedge"),
                               HasSubstr("uncertainty:"), HasSubstr("guard:       j = ")));
  const cv::Mat picture = cv::imread((folder_ / "wedge.png").string());
  ASSERT_FALSE(picture.empty());
  EXPECT_GT(picture.cols, 1000);
  EXPECT_TRUE(nlohmann::json::parse(read(folder_ / "wedge.json")).at("accepted").get<bool>());
}

// Guards count in the shortest side, and cover the displacement along the longest.
TEST_F(Commands, TheGuardIsThatOfTheCellsFlatVoxels) {
  workspace_.voxel_size_m = workspace::VoxelSize(Eigen::Vector3d(0.005, 0.005, 0.01));
  Request request = fit(source("deploy/parts/measurements/wedge.csv"));
  request.json = folder_ / "wedge.json";
  const Said said = call(request);
  ASSERT_EQ(said.exit_code, 0) << said.text;
  const auto object = nlohmann::json::parse(read(folder_ / "wedge.json")).at("object");
  const double off_mm = 1e3 * object.at("worst_displacement_m").get<double>();
  const int guard = static_cast<int>(std::max(std::ceil(off_mm / 5.0), 2.0 * std::ceil(off_mm / 10.0)));
  EXPECT_EQ(object.at("guard_vox"), guard);
  EXPECT_EQ(object.at("voxel_size_m"), (nlohmann::json{0.005, 0.005, 0.01}));
  EXPECT_THAT(said.text, HasSubstr("j = " + std::to_string(guard) +
                                   " (skin voxels of 5 mm, the shortest side of 5 x 5 x 10 mm)"));
}

TEST_F(Commands, TheSameSeedMeasuresTheSame) {
  Request request = simulate("wedge", "0.1 0 0.4 90 0 20");
  EXPECT_EQ(call(request).text, call(request).text);
  const std::string first = call(request).text;
  request.seed = 2;
  EXPECT_NE(call(request).text, first);
}

// Tries workspace_survey: a bad range
TEST_F(Commands, ABadRangeIsRefusedAndTheNodeNamed) {
  Request request = simulate("v_groove_block", "0 -0.1 0.301 90 0 200");
  request.out = folder_ / "bad.csv";
  request.range_errors = {"2=15"};
  call(request);
  const Said said = call(fit(folder_ / "bad.csv"));
  EXPECT_EQ(said.exit_code, 1);
  EXPECT_THAT(said.text, AllOf(HasSubstr("refused:"), HasSubstr("; the nearest: v_groove_block, but nodes '"),
                               HasSubstr("advice:      measure node '2' again: without it the others fit"),
                               Not(HasSubstr("guard:"))));
}

TEST_F(Commands, IdentifyListsCandidatesWithoutAPose) {
  Request request = fit(source("deploy/parts/measurements/wedge.csv"));
  request.what = "identify";
  const Said said = call(request);
  EXPECT_EQ(said.exit_code, 0);
  EXPECT_THAT(said.text, AllOf(HasSubstr("candidates: 1 of 9 parts"), Not(HasSubstr("guard:"))));
}

TEST_F(Commands, ALibraryWithoutThePartAndArgumentsThatCannotBeUsedAreNamed) {
  Request request = fit(source("deploy/parts/measurements/wedge.csv"));
  request.part = "cube";
  EXPECT_EQ(call(request).exit_code, 1);
  EXPECT_THAT(call(request).text, HasSubstr("no part of the library's 1 agrees"));
  request.part = "teapot";
  EXPECT_THAT(refusal([&] { call(request); }), HasSubstr("'teapot' is not in the library"));
  EXPECT_THAT(refusal([&] { call(simulate("cube", "1 2 3")); }), HasSubstr("--pose: '1 2 3'"));
  EXPECT_THAT(refusal([&] { call(simulate("cube", "0 0 90 0 0 0")); }), HasSubstr("--pose"));
  Request odd = simulate("cube", "0 0 0.3 0 0 0");
  odd.range_errors = {"2=much"};
  EXPECT_THAT(refusal([&] { call(odd); }), HasSubstr("--range-error: '2=much'"));
  odd.range_errors = {"99=1"};
  EXPECT_THAT(refusal([&] { call(odd); }), HasSubstr("--range-error: '99=1'"));
}

// The unit of the range mistaken: metres where the column says millimetres.
// Tries workspace_survey: out of the head's range
TEST_F(Commands, ARangeInTheWrongUnitIsOutsideOfTheHeadsRange) {
  const auto file = write("metres.csv", "face,part,node,range_mm,pan_deg,tilt_deg\nA,whole,1,3.6,0,45\n");
  EXPECT_THAT(refusal([&] { call(fit(file)); }),
              AllOf(HasSubstr("metres.csv:2"), HasSubstr("range 0.0036 m; allowed: 0.5 to 10 m")));
}

// Tries workspace_survey: two nodes on one spot … too few
TEST_F(Commands, CornersThatMakeNoFaceAreRefusedByName) {
  const auto rows = read_measurements(source("deploy/parts/measurements/wedge.csv"));
  ASSERT_TRUE(rows[0].reading && rows[1].reading);
  const auto line = [](const survey::Targeting& row, const std::string& node) {
    std::ostringstream out;
    out.precision(12);
    out << row.face << ",whole," << node << ',' << 1e3 * row.reading->range_m << ','
        << row.reading->pan_rad / core::kRadPerDegree << ',' << row.reading->tilt_rad / core::kRadPerDegree
        << '\n';
    return out.str();
  };
  const std::string head = "face,part,node,range_mm,pan_deg,tilt_deg\n", first = line(rows[0], "1"),
                    second = line(rows[1], "2");
  const Said one_spot = call(fit(write("spot.csv", head + first + second + line(rows[0], "3"))));
  EXPECT_EQ(one_spot.exit_code, 1);
  EXPECT_THAT(one_spot.text, HasSubstr("nodes '1' and '3' are on one spot"));
  const Said too_few = call(fit(write("few.csv", head + first + second)));
  EXPECT_EQ(too_few.exit_code, 1);
  EXPECT_THAT(too_few.text, HasSubstr("has 2 corners; allowed: at least 3"));
}

TEST_F(Commands, AssistLeadsThroughPracticeToAPose) {
  Request request;
  request.what = "assist";
  request.part = "v_groove_block";
  request.pose = "0.0 -0.1 0.301 90 0 200";
  const std::string kept = (folder_ / "kept.csv").string();
  const Said said = call(request, "help\n\n\n\n\nsend\ndone\n\n\n\npart\nsave " + kept + "\nquit\n");
  EXPECT_EQ(said.exit_code, 0) << said.text;
  EXPECT_THAT(said.text, AllOf(HasSubstr("RANGE PAN TILT"), HasSubstr("the head reads"),
                               HasSubstr("there is no accepted pose to send; nothing was sent"),
                               HasSubstr("face B, corner 1>"), HasSubstr("part:        v_groove_block"),
                               HasSubstr("A pose is found")));
  EXPECT_EQ(call(fit(kept)).exit_code, 0) << "what was kept gives the same";
  const Said taken_back = call(request, "\n\n\n\ndone\n\n\n\npart\nundo\nsend\nquit\n");
  EXPECT_EQ(taken_back.exit_code, 1) << "without the face that it rested on there is no pose";
  EXPECT_THAT(taken_back.text, HasSubstr("nothing was sent"));
}

// The empty line that follows a face's last corner ends the face: corners of two faces never mix.
TEST_F(Commands, AssistPractisesByEmptyLinesAlone) {
  for (const char* part : {"stepped_block", "v_groove_block", "wedge"}) {
    Request request;
    request.what = "assist";
    request.part = part;
    request.pose = "0.1 0 0.4 90 0 20";
    const Said said = call(request, std::string(30, '\n'));
    EXPECT_EQ(said.exit_code, 0) << said.text;
    EXPECT_THAT(said.text,
                AllOf(HasSubstr("face B, corner 1>"), HasSubstr(std::string("part:        ") + part),
                      Not(HasSubstr("mm too ")), Not(HasSubstr("plane of this face's other"))));
  }
  Request nowhere;
  nowhere.what = "assist";
  nowhere.part = "wedge";
  EXPECT_THAT(refusal([&] { call(nowhere); }),
              AllOf(HasSubstr("--pose: is missing"), Not(HasSubstr("--part"))));
}

// Tries workspace_survey: the end of a face forgotten in `assist`
TEST_F(Commands, AssistAsksWhetherACornerFarOffThePlaneBeginsAnotherFace) {
  const auto rows = read_measurements(source("deploy/parts/measurements/v_groove_block.csv"));
  std::string typed;
  for (const survey::Targeting& row : rows) {
    if (!row.reading) continue;
    std::ostringstream text;
    text.precision(10);
    text << 1e3 * row.reading->range_m << ' ' << row.reading->pan_rad / core::kRadPerDegree << ' '
         << row.reading->tilt_rad / core::kRadPerDegree << '\n';
    typed += text.str();
  }
  Request request;
  request.what = "assist";
  const std::string said = call(request, typed).text;
  const auto at = said.find("mm off the plane of this face's other corners");
  ASSERT_NE(at, std::string::npos) << said;
  EXPECT_THAT(said.substr(0, at), HasSubstr("corner 5>")) << "face A has four";
  EXPECT_THAT(said.substr(0, at), Not(HasSubstr("corner 6>")));
}

TEST_F(Commands, AssistEndsWithTheOutcomeOfItsLastSend) {
  const auto targetings = read_measurements(source("deploy/parts/measurements/v_groove_block.csv"));
  AssistSetup setup;
  setup.practice = targetings;
  int code = 3;
  setup.send = [&](const SurveyReport&) { return Sent{"sent: " + std::to_string(code), code}; };
  const auto end_of = [&](const std::string& after) {
    std::istringstream in(std::string(9, '\n') + after);
    std::ostringstream out;
    const int ended = assist(shipped_config(), load_library(source("deploy/parts")), setup, in, out);
    EXPECT_THAT(out.str(), HasSubstr("A pose is found")) << out.str();
    return ended;
  };
  EXPECT_EQ(end_of(""), 0);
  EXPECT_EQ(end_of("send\n"), 3);
  code = 1;
  EXPECT_EQ(end_of("send\nshow\nquit\n"), 1);
  code = 0;
  EXPECT_EQ(end_of("send\n"), 0);
}

TEST_F(Commands, AssistTakesReadingsRefusesBadOnesAndLetsThemBeMeasuredAgain) {
  const auto rows = read_measurements(source("deploy/parts/measurements/brick.csv"));
  const auto line = [&](std::size_t i, double more_mm = 0) {
    const survey::Reading& r = *rows[i].reading;
    std::ostringstream text;
    text.precision(10);
    text << 1e3 * r.range_m + more_mm << ' ' << r.pan_rad / core::kRadPerDegree << ", "
         << r.tilt_rad / core::kRadPerDegree;
    return text.str();
  };
  ASSERT_TRUE(rows[0].reading && rows[1].reading && rows[2].reading && rows[3].reading);
  Request request;
  request.what = "assist";
  const std::string typed = line(0) + "\n" + line(0) + "\n0 10 10\nnonsense\ndone\n=7\nundo\nundo\n" +
                            line(0) + "\n" + line(1, 80) + "\n" + line(2) + "\n" + line(3) +
                            "\ndone\nagain 9 1 2 3\nagain 2 " + line(1) + "\nmore 2 " + line(1, 0.5) + "\n";
  const Said said = call(request, typed);
  EXPECT_THAT(said.text,
              AllOf(HasSubstr("refused: that is 0.0 mm from node 1"), HasSubstr("range 0 m; allowed"),
                    HasSubstr("'nonsense' is neither a word that I know"),
                    HasSubstr("1 corners so far; a whole face needs at least 3"),
                    HasSubstr("node '7': has no reading"), HasSubstr("forgot node 1 of face A"),
                    HasSubstr("there is nothing to forget")));
  EXPECT_THAT(said.text, AllOf(HasSubstr("refused:     no part"), HasSubstr("no node '9' was measured"),
                               HasSubstr("node 2 has the new reading"),
                               HasSubstr("node 2 has one reading more"), HasSubstr("brick")));
}

}  // namespace
}  // namespace phantom::workspace_survey
