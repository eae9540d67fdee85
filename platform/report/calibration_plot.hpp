/// A calibration as a picture: what was measured, and the model through it.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace roborun::report {

struct CalibrationPoint {
  double volume_m3{};
  double measured_s{};
  bool hold_out{};
};
/// One precision: points, and the model as a line fixed + slope * volume.
struct CalibrationCurve {
  double cell_m{};
  double fixed_s{};
  double slope_s_per_m3{};
  std::vector<CalibrationPoint> points;
};
struct CalibrationPanel {
  std::string title;
  std::vector<CalibrationCurve> curves;
};

/// A complete SVG file without external resources: a panel a stage, logarithmic in volume and time, a colour
/// a precision; filled points were fitted, open ones held out.
[[nodiscard]] std::string calibration_svg(const std::string& title,
                                          const std::vector<CalibrationPanel>& panels);

}  // namespace roborun::report
