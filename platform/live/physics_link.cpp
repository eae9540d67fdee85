#include "platform/live/physics_link.hpp"

#include "platform/live/ardupilot_physics.hpp"
#include "platform/live/px4_physics.hpp"

namespace roborun::live {

std::unique_ptr<PhysicsLink> physics_link(const PlantPhysics& physics,
                                          const sensor_port::EarthPlace& origin) {
  if (physics.kind == mission::AutopilotKind::kPx4) return std::make_unique<Px4Physics>(physics.port, origin);
  return std::make_unique<ArduPilotPhysics>(physics.port);
}

}  // namespace roborun::live
