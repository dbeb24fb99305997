// A dynamic_reconfigure server in C++, as reconfigure_peer.py serves it in Python; the header is that of Lamp.cfg.
#include <dynamic_reconfigure/server.h>
#include <lamp/LampConfig.h>
#include <ros/ros.h>

#include <iostream>

void callback(lamp::LampConfig &config, uint32_t level) {
  std::cout << "callback " << static_cast<int32_t>(level) << " " << config.power << std::endl;
  if (config.mode == lamp::Lamp_Morse) config.brightness = 0.75;
}

int main(int argc, char **argv) {
  ros::init(argc, argv, "lamp");
  ros::NodeHandle node("~");
  dynamic_reconfigure::Server<lamp::LampConfig> server(node);
  server.setCallback(callback);
  std::cout << "ready" << std::endl;
  ros::spin();
}
