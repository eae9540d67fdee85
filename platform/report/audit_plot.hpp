/// The plots of an audit's page, each an <svg> element; empty where there is nothing to show.
#pragma once

#include <string>

#include "platform/report/audit_report.hpp"

namespace roborun::report {

/// Share of samples that took longer, over duration, both logarithmic. `limit_us` (0: none) is drawn.
[[nodiscard]] std::string exceedance_plot(const std::string& title, const TimingSummary& timing,
                                          double limit_us);
/// Worst jitter and worst response of each stretch of the run, its missed deadlines, and the lane's period.
[[nodiscard]] std::string time_line_plot(const AuditLane& lane, double seconds);
/// Return levels: every block's maximum beside the fitted distribution with its 95 % band, on to one block in 1e9.
[[nodiscard]] std::string return_level_plot(const std::string& title, const Pwcet& pwcet);

}  // namespace roborun::report
