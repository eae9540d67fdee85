/// Numbers of IMU, GNSS and odometry models besides `clean`. "assumed": no source gives it.
#pragma once

namespace roborun::sitl {

/// A standard precision receiver with a compass in its housing, as on most vehicles of this size: u-blox NEO-M9N with a magnetometer.
/// Each horizontal axis has 1.5 m CEP (data sheet UBX-19014285, open sky) / 1.177 = 1.27 m = drift, multipath and noise together;
/// twice as much upwards.
struct GnssErrors {
  /// Orbits and ionosphere: Gauss-Markov with 1,100 s (Rankin 1994, in Beard and McLain, "Small Unmanned Aircraft", 2012, table 7.1).
  double drift_m{1.1}, drift_s{1100.0};
  /// Gauss-Markov; `shaded_m` is added times the share of the sky that is hidden: 4 m between two rows of houses. Assumed.
  double multipath_m{0.5}, shaded_m{8.0}, multipath_s{15.0};
  double noise_m{0.21};    ///< Of each fix (Beard and McLain, the same table).
  double up_ratio{2.0};    ///< Upwards.
  double speed_mps{0.05};  ///< Data sheet: 0.05 m/s; under a hidden sky up to five times as much, assumed.
  double speed_shaded_ratio{4.0};
  double least_sky_ratio{0.15};  ///< With less of the sky there is no fix. Assumed.
  double latency_s{0.12};        ///< u-blox at 10 Hz over a serial line, assumed.
  double lost_ratio{0.01};
  /// What it says of itself in the open. It knows nothing of multipath but the geometry: half of what the hidden sky adds.
  double said_m{1.3}, said_up_m{2.6};
  // The compass, after calibration (PX4 and ArduPilot accept some degrees; all assumed).
  double compass_bias_deg{2.0};     ///< Constant, one sigma.
  double compass_iron_deg{2.0};     ///< One and two periods in a turn, one sigma each.
  double compass_current_deg{3.0};  ///< At full throttle, one sigma over vehicles.
  double compass_place_deg{3.0};  ///< One sigma over places, cells of 4 m: steel in the ground and in walls.
  double compass_noise_deg{0.7};
  double said_heading_rad{0.09};  ///< 5 degrees.
};

/// A visual-inertial odometry. Its drift is 1 % of the way flown: 0.6 % along it and 0.4 % of it up or down for good, 0.6 % aside by
/// its heading that wanders (root of the sum of squares: 0.94 %). Intel says "below 1 %" of the T265's closed loops; of the eight
/// methods of Delmerico and Scaramuzza, "A benchmark comparison of monocular visual-inertial odometry algorithms for flying
/// robots" (ICRA 2018), the better ones drift by 0.3 to 1 %. Both quoted without the document at hand.
struct OdometryErrors {
  double rate_Hz{30.0};     ///< Of the images.
  double latency_s{0.040};  ///< Assumed: exposure, features, optimisation.
  double scale_ratio{0.006}, climb_ratio{0.004};
  double yaw_rad{0.006}, yaw_s{60.0};  ///< Gauss-Markov.
  // Of each sample; assumed.
  double position_m{0.004}, attitude_rad{0.003}, speed_mps{0.02};
  /// It loses its features and begins anew at zero, facing ahead: from half to one and a half of this; assumed.
  double reset_every_s{180.0};
  double silent_s{0.3};  ///< Meanwhile.
  // What it says of itself.
  double said_m{0.02}, said_rad{0.01}, said_mps{0.05};
};

/// A consumer MEMS part on a damped plate: TDK ICM-42688-P data sheet (DS-000347): 2.8 mdps and 70 ug per sqrt(Hz), here over 200 Hz;
/// sensitivity 0.5 %; cross axes 1.25 %, half of which calibration leaves (assumed).
struct ImuErrors {
  double gyro_noise_radps{0.0007};
  double accel_noise_mps2{0.0097};
  double gyro_bias_radps{0.003};  ///< At switch-on, after calibration on the ground; assumed.
  double accel_bias_mps2{0.1};    ///< 20 mg of the data sheet, half of it calibrated.
  double gyro_walk_radps{4e-5};  ///< Per sqrt(s). Assumed: 0.04 degrees/s in 5 minutes, with the temperature.
  double accel_walk_mps2{1e-3};  ///< Per sqrt(s). Assumed.
  double scale_ratio{0.005};
  double misalignment_ratio{0.006};
  /// Of one rotor at full thrust: amplitude goes with thrust (imbalance times turning rate squared). PX4's and ArduPilot's guides call
  /// less than 15 to 30 m/s2 of vibration good; assumed for balanced propellers on dampers.
  double vibration_mps2{1.5}, vibration_radps{0.02};
  double rotor_Hz{150.0};  ///< At full thrust: 9,000 turns a minute.
};

}  // namespace roborun::sitl
