#include "components/wva_server/activate_command.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "common/core/errors.hpp"
#include "components/wva_server/progress_bar.hpp"
#include "components/wva_server/tests/test_cell.hpp"

namespace phantom::wva_server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class ActivateCommand : public TestCell {
 protected:
  /// Runs the command line and returns what it prints.
  nlohmann::json run(const std::string& arguments) const {
    ActivateRequest request;
    runtime::CommandLine line("activate", "", "");
    add_options(line.root(), request);
    line.parse(arguments + " --export " + out().string());
    std::ostringstream print;
    EXPECT_EQ(run_activate(request, {}, print), 0);
    EXPECT_EQ(print.str().find('\n'), print.str().size() - 1);  // one line
    return nlohmann::json::parse(print.str());
  }
  std::string refusal(const std::string& arguments) const {
    try {
      run(arguments);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "accepted";
  }
  std::filesystem::path out() const { return folder_ / "out.nrrd"; }
  std::string mesh(const std::string& rest) const {
    return "--mesh " + (folder_ / "post.stl").string() + " --voxel-size-m 0.01 --layers 2,3 --mu 32,20 " +
           rest;
  }
};

TEST_F(ActivateCommand, ActivatesAMesh) {
  const auto line = run(mesh("--scale 0.001 --pose \"0.0031 0.0031 0.0031 0 0 0\""));
  // A post of 4×4×30 voxels off the lattice lies in 5×5×31, with five voxels of layers on each side.
  EXPECT_EQ(line["size_vox"], (std::vector<int>{15, 15, 41}));
  EXPECT_NEAR(line["origin_m"][2].get<double>(), -0.20, 1e-9);
  EXPECT_EQ(line["voxels"]["101"], 3 * 3 * 29);
  EXPECT_EQ(line["voxels"]["100"], 5 * 5 * 31 - 3 * 3 * 29);
  std::uint64_t all = 0;
  for (const auto& count : line["voxels"]) all += count.get<std::uint64_t>();
  EXPECT_EQ(all, 15U * 15U * 41U);
  EXPECT_TRUE(line["seconds"]["total"].is_number());
  EXPECT_GT(std::filesystem::file_size(out()), 100U);
}

TEST_F(ActivateCommand, TakesASideForEachAxis) {
  const std::string report = (folder_ / "fidelity.json").string();
  const std::string post = "--mesh " + (folder_ / "post.stl").string() +
                           " --scale 0.001 --pose \"0.0031 0.0031 0.0031 0 0 0\" --layers 2,3 --mu 32,20 ";
  const auto line = run(post + "--voxel-size-m 0.01,0.01,0.02 --method surface --fidelity " + report +
                        " --picture " + (folder_ / "flat.png").string());
  EXPECT_EQ(line["size_vox"], (std::vector<int>{15, 15, 26}));
  EXPECT_EQ(line["voxel_size_m"], (std::vector<double>{0.01, 0.01, 0.02}));
  EXPECT_NEAR(line["origin_m"][2].get<double>(), -0.26, 1e-9);
  EXPECT_EQ(line["voxels"]["101"], 3 * 3 * 14);
  EXPECT_EQ(line["voxels"]["100"], 5 * 5 * 16 - 3 * 3 * 14);
  std::ifstream file(report);
  const auto fidelity = nlohmann::json::parse(file);
  EXPECT_EQ(fidelity["voxel_size_m"], (std::vector<double>{0.01, 0.01, 0.02}));
  const auto& outer = fidelity["layers"][1];
  EXPECT_EQ(outer["offset_vox"], 5.0);
  // A face lies at most half a voxel's side off: of sides of 1 along x, of 2 along z.
  for (const char* side : {"-x", "+x", "-z", "+z"}) {
    const double most = side[1] == 'z' ? 1.0 : 0.5;
    EXPECT_GE(outer["sides"][side]["min_vox"].get<double>(), -most - 1e-3) << side;
    EXPECT_LE(outer["sides"][side]["max_vox"].get<double>(), most + 1e-3) << side;
    EXPECT_GT(outer["sides"][side]["faces"], 10) << side;
  }
  EXPECT_THAT(refusal(post + "--voxel-size-m 0.01,0.02"), HasSubstr("has 2 numbers; allowed: one, or three"));
  EXPECT_THAT(refusal(post + "--voxel-size-m 0.01,0.01,0.01,0.01"), HasSubstr("has 4 numbers"));
  EXPECT_THAT(refusal(post + "--voxel-size-m 0.01,0.1,0.01"),
              HasSubstr("is 10 times as long along y as along x; allowed: at most 8 times"));
  EXPECT_THAT(refusal(post + "--voxel-size-m 0.01,0,0.01"), HasSubstr("--voxel-size-m"));
}

TEST_F(ActivateCommand, TakesPosesInDegrees) {
  const auto line = run(mesh("--scale 0.001 --pose \"0.0031 0.0031 0.0031 90 0 0\""));
  EXPECT_EQ(line["size_vox"], (std::vector<int>{15, 41, 15}));
}

TEST_F(ActivateCommand, FitsAMeshToAnExtent) {
  const auto line = run(mesh("--fit-extent-m 0.3 --pose 0.0031,0.0031,0.0031,0,0,0"));
  EXPECT_EQ(line["size_vox"], (std::vector<int>{15, 15, 41}));
}

TEST_F(ActivateCommand, WrapsTheGuardOnTheBody) {
  const auto line =
      run(mesh("--scale 0.001 --guard 2 --field mu --encoding raw --pose \"0.0031 0.0031 0.0031 0 0 0\""));
  EXPECT_EQ(line["size_vox"], (std::vector<int>{19, 19, 45}));
  EXPECT_GT(line["voxels"]["99"], 0);
  EXPECT_GT(std::filesystem::file_size(out()), 19U * 19U * 45U * 4U);
}

TEST_F(ActivateCommand, ActivatesACell) {
  const auto line = run("--cell " + cell().string() + " --field object");
  EXPECT_EQ(line["size_vox"], (std::vector<int>{80, 80, 50}));
  EXPECT_EQ(line["objects"].size(), 3U);
  EXPECT_GT(line["bricks"], 0);
}

TEST_F(ActivateCommand, LaysLayersByEveryMethod) {
  std::set<std::string> told;
  for (const char* method :
       {"", "--method distance", "--method surface", "--method dilation", "--method dilation --element cube",
        "--method dilation --element sphere-contained"}) {
    const auto line = run(mesh(std::string("--scale 0.001 --pose \"0.0031 0.0031 0.0031 0 0 0\" ") + method));
    told.insert(line["method"].get<std::string>() + line["voxels"].dump());
    EXPECT_EQ(line["voxels"]["101"], 3 * 3 * 29) << method;
    EXPECT_GT(line["voxels"]["2"], 1000) << method;
  }
  EXPECT_EQ(told.size(), 5U);  // the default is one of the others, and these all differ
}

TEST_F(ActivateCommand, LaysLayersInsideTheBody) {
  const std::string pose = "--scale 0.001 --pose \"0.0031 0.0031 0.0031 0 0 0\" ";
  const auto line = run("--mesh " + (folder_ / "post.stl").string() +
                        " --voxel-size-m 0.01 --layers 1,3 --mu 32,20 --inside 2 " + pose);
  // The interior is 3×3×29: all but its middle line touches the boundary, and that lies two voxels deep but
  // for its ends.
  EXPECT_EQ(line["voxels"]["-1"], 3 * 3 * 29 - 27);
  EXPECT_EQ(line["voxels"]["-2"], 27);
  EXPECT_FALSE(line["voxels"].contains("101"));
  EXPECT_THAT(refusal(mesh("--inside 2 --mu-inside 40")), HasSubstr("one per layer"));
  EXPECT_THAT(refusal(mesh("--inside 2 --mu-inside 60,40")), HasSubstr("does not rise inwards"));
  EXPECT_THAT(refusal(mesh("--inside 1 --mu-skin 32")), HasSubstr("does not rise inwards"));
}

TEST_F(ActivateCommand, WritesAPicture) {
  const auto file = folder_ / "post.png";
  run(mesh("--scale 0.001 --guard 1 --inside 1 --picture " + file.string()));
  const cv::Mat picture = cv::imread(file.string());
  ASSERT_FALSE(picture.empty());
  std::set<int> colours;  // of boundary, inside, guard and both layers, and of the paper
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const auto pixel = picture.at<cv::Vec3b>(y, x);
      colours.insert(pixel[0] << 16 | pixel[1] << 8 | pixel[2]);
    }
  }
  for (const int colour : {0x1E1E1E, 0x78BEE1, 0xB43C8C, 0x261CC8, 0xEBCD96, 0xFFFFFF})
    EXPECT_TRUE(colours.contains(colour)) << colour;
  EXPECT_THAT(refusal(mesh("--picture post.jpg")), HasSubstr(".png"));
  EXPECT_THAT(refusal(mesh("--scale 0.001 --picture /no/such/folder/a.png")), HasSubstr("--picture"));
}

TEST_F(ActivateCommand, ReportsFidelity) {
  const auto csv = folder_ / "post.csv", as_json = folder_ / "post.json";
  run(mesh("--scale 0.001 --guard 1 --fidelity " + csv.string()));
  std::ifstream file(csv);
  std::string line;
  std::vector<std::string> lines;
  while (std::getline(file, line)) lines.push_back(line);
  ASSERT_EQ(lines.size(), 1U + 3U * 9U);  // guard and two layers; all sides together, and each
  EXPECT_EQ(lines[0], "layer,side,offset_vox,method,faces,mean_vox,rms_vox,min_vox,max_vox");
  EXPECT_THAT(lines[1], HasSubstr("guard,all,1,distance,"));
  EXPECT_THAT(lines[10], HasSubstr("1,all,3,distance,"));
  run(mesh("--scale 0.001 --method dilation --element cube --fidelity " + as_json.string()));
  std::ifstream other(as_json);
  const auto report = nlohmann::json::parse(other);
  EXPECT_EQ(report["method"], "dilation cube");
  ASSERT_EQ(report["layers"].size(), 2U);
  EXPECT_GT(report["layers"][1]["sides"]["corners"]["max_vox"],
            2.0);  // √3·5 instead of 5, but for the solid's own voxels
  EXPECT_THAT(refusal(mesh("--fidelity post.txt")), HasSubstr(".csv or .json"));
}

TEST_F(ActivateCommand, WarnsOfWhatItHadToGuess) {
  const auto line = run(mesh("--pose \"0.0031 0.0031 0.0031 0 0 0\""));
  EXPECT_THAT(line["objects"][0]["warnings"].dump(), HasSubstr("up-axis"));
  EXPECT_EQ(line["objects"][0]["mesh"]["open_edges"], 0);
  const auto told = run(mesh("--scale 0.001 --up-axis z"));
  EXPECT_THAT(told["objects"][0]["warnings"].dump(), Not(HasSubstr("up-axis")));
}

// Tries wva_server: a profile of which no layer has a voxel along an axis
// Tries wva_server: a layer is thinner than a voxel's longest side
TEST_F(ActivateCommand, WarnsOfLayersThinnerThanAVoxelAndRefusesSuchAsEndBeforeOne) {
  const std::string post = "--mesh " + (folder_ / "post.stl").string() +
                           " --scale 0.001 --voxel-size-m 0.01,0.01,0.04 --mu 32,20 --layers ";
  EXPECT_THAT(run(post + "2,3")["objects"][0]["warnings"].dump(),
              HasSubstr("the profile's layers 1, 2 are thinner than a voxel is long along z, 0.04 m"));
  EXPECT_THAT(run(post + "4,4")["objects"][0]["warnings"].dump(), Not(HasSubstr("thinner")));
  EXPECT_THAT(refusal(post + "1,2"),
              AllOf(HasSubstr("--layers: "), HasSubstr("reach 0.03 m"), HasSubstr("along z")));
}

// A box of 0.2 × 0.3 × 0.4 m, some of whose triangles come again or face the wrong way; one without a lid;
// and one that another passes through.
TEST_F(ActivateCommand, ReportsTheVolumeOfWhatIsSolidOrNone) {
  const auto box = [](double x_m) {
    std::ostringstream text;
    for (int corner = 0; corner < 8; ++corner)
      text << "v " << x_m + 0.2 * (corner & 1) << ' ' << 0.3 * (corner >> 1 & 1) << ' ' << 0.4 * (corner >> 2)
           << '\n';
    return text.str();
  };
  const std::string sides =
      "f 1 2 6\nf 1 6 5\nf 2 4 8\nf 2 8 6\nf 4 3 7\nf 4 7 8\nf 3 1 5\nf 3 5 7\nf 1 4 2\nf 1 3 4\n";
  const auto report = [&](const std::string& faces) {
    std::ofstream(folder_ / "box.obj") << faces;
    return run("--mesh " + (folder_ / "box.obj").string() +
               " --scale 1 --up-axis z --voxel-size-m 0.01 --layers 2,3 --mu 32,20")["objects"][0];
  };
  constexpr double kBox_m3 = 0.2 * 0.3 * 0.4;
  EXPECT_NEAR(report(box(0.0) + sides + "f 5 6 8\nf 5 8 7\n")["mesh"]["volume_m3"].get<double>(), kBox_m3,
              1e-7);
  const auto defect = report(box(0.0) + sides + "f 5 8 6\nf 5 8 7\n" + "f 1 2 6\nf 6 2 1\nf 8 2 4\n");
  EXPECT_NEAR(defect["mesh"]["volume_m3"].get<double>(), kBox_m3, 1e-7);
  EXPECT_EQ(defect["mesh"]["duplicate_triangles"], 3);
  EXPECT_EQ(defect["mesh"]["flipped_triangles"], 1);
  EXPECT_THAT(defect["warnings"].dump(),
              AllOf(HasSubstr("the mesh has 3 triangles twice"),
                    HasSubstr("the mesh has 1 triangle that faces the wrong way")));
  const auto open = report(box(0.0) + sides);
  EXPECT_TRUE(open["mesh"]["volume_m3"].is_null()) << "what has no lid encloses nothing";
  EXPECT_THAT(open["warnings"].dump(), HasSubstr("the mesh has 4 open edges"));
  std::ostringstream second;
  std::istringstream words(std::string(sides) + "f 5 6 8\nf 5 8 7\n");
  for (std::string word; words >> word;)
    second << (word == "f" ? "\nf" : " " + std::to_string(std::stoi(word) + 8));
  const auto crossed = report(box(0.0) + box(0.1) + sides + "f 5 6 8\nf 5 8 7\n" + second.str() + "\n");
  EXPECT_GT(crossed["mesh"]["intersecting_pairs"], 0);
  EXPECT_TRUE(crossed["mesh"]["volume_m3"].is_null()) << "what both enclose would count twice";
}

TEST_F(ActivateCommand, TakesAnotherMethodForAWholeCell) {
  const std::string file = "--cell " + cell().string();
  const auto own = run(file), dilated = run(file + " --method dilation --element cube --threads 2");
  EXPECT_EQ(own["method"], "distance");
  EXPECT_EQ(dilated["method"], "dilation cube");
  EXPECT_GT(dilated["voxels"]["1"], own["voxels"]["1"]);
}

TEST(ProgressBar, ShowsTheShare) {
  EXPECT_EQ(bar_text("part.stl", 0.5), "part.stl [####################                    ]  50 %");
  EXPECT_EQ(bar_text("a", 7.0), "a [" + std::string(40, '#') + "] 100 %");
}

TEST_F(ActivateCommand, RefusesArgumentsThatContradictEachOther) {
  EXPECT_THAT(refusal(""), HasSubstr("--mesh, --cell"));
  EXPECT_THAT(refusal(mesh("--cell " + cell().string())), HasSubstr("exactly one"));
  EXPECT_THAT(refusal("--cell " + cell().string() + " --guard 1"), HasSubstr("cell file says"));
  EXPECT_THAT(refusal(mesh("--element cube")), AllOf(HasSubstr("--element"), HasSubstr("--method dilation")));
  EXPECT_THAT(refusal("--cell " + cell().string() + " --inside 1"), HasSubstr("cell file says"));
  EXPECT_THAT(refusal(mesh("--scale 0.001 --fit-extent-m 1")), HasSubstr("only one"));
  EXPECT_THAT(refusal("--mesh " + (folder_ / "post.stl").string()), HasSubstr("--voxel-size-m"));
}

TEST_F(ActivateCommand, RefusesValuesThatCannotBe) {
  const std::string post =
      "--mesh " + (folder_ / "post.stl").string() + " --scale 0.001 --voxel-size-m 0.01 ";
  EXPECT_THAT(refusal(post + "--layers 2,3 --mu 20,32"), HasSubstr("fall outwards"));
  EXPECT_THAT(refusal(post + "--layers 2 --mu 32,20"), HasSubstr("one per layer"));
  EXPECT_THAT(refusal(mesh("--pose \"1 2 3\"")), HasSubstr("six numbers"));
  EXPECT_THAT(refusal(mesh("--pose \"1 2 3 4 5 six\"")), HasSubstr("six numbers"));
  EXPECT_THAT(refusal(mesh("--scale 1000")), AllOf(HasSubstr("post.stl"), HasSubstr("scale")));
}

TEST_F(ActivateCommand, TakesFileNamesThatAreNotUtf8) {
  const auto odd = folder_ / "post\xff.stl";
  std::filesystem::copy_file(folder_ / "post.stl", odd);
  const auto line =
      run("--mesh " + odd.string() + " --voxel-size-m 0.01 --layers 2 --mu 32 --scale 0.001 --fidelity " +
          (folder_ / "post.json").string());
  EXPECT_EQ(line["objects"][0]["name"], "post\xEF\xBF\xBD.stl");
}

TEST_F(ActivateCommand, ACellNeedsNoArm) {
  write("bare.yaml", R"(name: bare
workspace: {min_m: [0, 0, 0], max_m: [0.4, 0.4, 0.4], voxel_size_m: 0.02}
profile: {thickness_vox: [2], mu_Pa_s_per_m: [32]}
objects:
  - {name: ball, primitive: {sphere: {radius_m: 0.1}}, pose: {xyz_m: [0.2, 0.2, 0.2]}}
)");
  EXPECT_GT(run("--cell " + (folder_ / "bare.yaml").string())["voxels"]["100"], 0);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// Tries wva_server: would take more memory
TEST_F(ActivateCommand, SaysThatMemoryDoesNotSuffice) {
  const auto in_little_memory = [&] {
    const rlimit limit{128 << 20, 128 << 20};
    setrlimit(RLIMIT_DATA, &limit);
    const std::string said = refusal("--mesh " + (folder_ / "post.stl").string() +
                                     " --scale 0.001 --voxel-size-m 0.001 --layers 254 --mu 32");
    std::fputs(said.c_str(), stderr);
    std::_Exit(said.find("needs more memory than the 128 MiB") != std::string::npos ? 0 : 1);
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(in_little_memory(), ::testing::ExitedWithCode(0), "Is the scale right");
}
#endif

TEST_F(ActivateCommand, NamesAMissingMesh) {
  ActivateRequest request;
  request.mesh = folder_ / "nowhere.stl";
  request.voxel_size_m = {0.01};
  request.layers = {1};
  request.mu = {5.0};
  request.out = out();
  std::ostringstream print;
  EXPECT_THROW(run_activate(request, {}, print), core::MissingError);
  EXPECT_FALSE(std::filesystem::exists(out()));
}

TEST_F(ActivateCommand, NamesAFolderThatIsNotThere) {
  ActivateRequest request;
  request.cell = cell();
  request.out = "/no/such/folder/out.nrrd";
  std::ostringstream print;
  EXPECT_THROW(run_activate(request, {}, print), core::ConfigError);
  // Before any work: the mesh is not there either.
  const std::string nowhere = "--mesh nowhere.stl --voxel-size-m 0.01 --layers 1 --mu 5 ";
  EXPECT_THAT(refusal(nowhere + "--picture /no/such/folder/a.png"),
              AllOf(HasSubstr("--picture"), HasSubstr("there is no folder /no/such/folder")));
  EXPECT_THAT(refusal(nowhere + "--fidelity /no/such/folder/a.csv"), HasSubstr("--fidelity"));
  EXPECT_THAT(refusal(nowhere + "--scale nan"), HasSubstr("--scale: is not a finite number"));
  EXPECT_THAT(refusal("--mesh nowhere.stl --voxel-size-m nan --layers 1 --mu 5"),
              HasSubstr("--voxel-size-m"));
}

}  // namespace
}  // namespace phantom::wva_server
