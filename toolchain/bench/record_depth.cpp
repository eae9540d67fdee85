// Writes a recording of the simulated depth camera: 640 x 480 pixels, in a room or a yard.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tests/platform/dataset/simulated_recording.hpp"

int main(int argc, char** argv) {
  using namespace roborun;
  if (argc != 5 || (std::strcmp(argv[2], "room") != 0 && std::strcmp(argv[2], "yard") != 0) || !model_of<CameraModel>(argv[3]) ||
      std::atoi(argv[4]) < 1) {
    std::fprintf(stderr, "usage: bench_record_depth FOLDER room|yard MODEL FRAMES\n");
    return 2;
  }
  test::SimulatedRecording how;
  how.width = 640;
  how.height = 480;
  how.model = *model_of<CameraModel>(argv[3]);
  how.frames = std::atoi(argv[4]);
  test::write_recording(argv[1], std::strcmp(argv[2], "room") == 0 ? test::room() : test::yard(), how);
  return 0;
}
