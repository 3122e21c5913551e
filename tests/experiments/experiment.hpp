#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/experiments/report.hpp"

namespace phantom::experiments {

/// A law of the physics that is broken on purpose, to see which experiments notice (rig.hpp applies it).
enum class Sabotage {
  kNone,
  kConstantMu,      ///< every layer has the viscosity of layer 1
  kLayersOffByOne,  ///< every layer lies one voxel too far out
  kIgnoredSpeed,    ///< the drag is that of a fixed speed, whatever the speed is
  kGrownBodies,     ///< bodies reach a voxel farther out on every side than their meshes
  kIgnoredOffset,   ///< the survey's beam is taken to begin in the head's centre of rotation
  kCubicClusters,   ///< every cluster sensor reads the whole cube
  kCubicElements,   ///< every shaping element is the whole cube
  kUnitElements,    ///< where its cells are counted, every shaping element is that of m = 1
  kLatestObject,    ///< where objects' layers meet, the later one's fluid prevails
  kNoMemory,        ///< the buffer of past voxels holds the present one alone
  kUnfacedFilter,   ///< the search's surface direction test lets every triangle pass
  kWeightless,      ///< the simulated arm has no weight, with counterweights or without
  kSilence,         ///< the phantom tells nothing of what is near but its drag: no tone, view or contact
  kUnitRatio        ///< a master's joint leads the arm's, and feels it, as if their ratio were 1
};

struct Settings {
  bool fast = false;  ///< coarser or shorter where that saves time; the same checks
  Sabotage sabotage = Sabotage::kNone;
  std::filesystem::path out;         ///< the experiment's folder is OUT/ID
  std::filesystem::path source_dir;  ///< of the repository
  std::filesystem::path bin_dir;     ///< where the product's executables stand
};

/// One row of the specification's table of experiments.
struct Experiment {
  std::string id;                     ///< "mpc-steps"
  std::string title;                  ///< in words, as a heading
  std::string source;                 ///< figures and tables of the thesis
  std::string statement;              ///< what the thesis states, and the checks look for
  std::vector<Sabotage> fails_under;  ///< exactly these make a check fail
  void (*run)(Report& report, const Settings& settings) = nullptr;
};

/// All experiments, in the specification's order.
const std::vector<Experiment>& experiments();

}  // namespace phantom::experiments
