"""The twin of the fan hears what the PLC tells."""

from fan_bridge.bridge import FanBridge
from std_msgs.msg import Int32


def test_the_twin_of_the_fan_answers_the_plc(rotorsoil_twin):
    twin = rotorsoil_twin('plant_fan')
    twin.add(FanBridge(context=twin.context))
    twin.publisher('/plc/fan/rpm', Int32).publish(Int32(data=990))
    answer = twin.velocity_rms.receive()
    assert 0.1 < 1e3 * answer.velocity('drive_end_housing_x') < 4.5  # mm/s rms: zone A or B
