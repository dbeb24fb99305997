// A dynamic_reconfigure server in C++, as reconfigure_peer.py serves it in Python; the header is that of Lamp.cfg.
// With the word "show" it prints instead what the header knows and does.
#include <dynamic_reconfigure/server.h>
#include <lamp/LampConfig.h>
#include <ros/ros.h>

#include <iomanip>
#include <iostream>
#include <limits>

void callback(lamp::LampConfig &config, uint32_t level) {
  std::cout << "callback " << static_cast<int32_t>(level) << " " << config.power << std::endl;
  if (config.mode == lamp::Lamp_Morse) config.brightness = 0.75;
}

using lamp::LampConfig;

void print(const char *what, const LampConfig &config) {
  dynamic_reconfigure::Config message;
  config.__toMessage__(message);
  const auto &group = config.groups;
  std::cout << what << "\n" << message << group.name << group.state << group.color_choice.name
            << group.color_choice.state << group.color_choice.inner.name << group.color_choice.inner.state << std::endl;
}

int show() {
  const LampConfig &usual = LampConfig::__getDefault__();
  std::cout << std::setprecision(17) << LampConfig::__getDescriptionMessage__();
  print("default", usual);
  print("max", LampConfig::__getMax__());
  print("min", LampConfig::__getMin__());

  LampConfig config = usual;
  config.power = 1000, config.brightness = -3, config.angle = 7, config.label = "x";
  config.hue = std::numeric_limits<double>::quiet_NaN();
  std::cout << config.__level__(usual) << std::endl;
  config.__clamp__();
  print("clamped", config);
  std::cout << config.__level__(usual) << " " << usual.__level__(config) << std::endl;

  dynamic_reconfigure::Config message;
  config.__toMessage__(message);
  message.groups[2].state = false;
  message.ints[0].value = 33;
  LampConfig read = usual;
  std::cout << read.__fromMessage__(message) << std::endl;
  print("read", read);
  std::cout << read.groups.power << read.groups.color_choice.color << read.groups.color_choice.inner.hue << std::endl;
  message.ints[0].name = "nothing";
  std::cout << read.__fromMessage__(message) << std::endl;
  dynamic_reconfigure::Config empty;
  std::cout << read.__fromMessage__(empty) << std::endl;

  for (const auto &each : LampConfig::__getParamDescriptions__()) {
    boost::any value;
    each->getValue(read, value);
    std::cout << each->name << " " << each->type << " " << value.type().name() << std::endl;
  }
  for (const auto &each : LampConfig::__getGroupDescriptions__())
    std::cout << each->name << each->id << each->parent << each->state << each->parameters.size() << std::endl;
  std::cout << lamp::Lamp_Steady << lamp::Lamp_Morse << lamp::Lamp_Red << std::endl;
  return 0;
}

int main(int argc, char **argv) {
  if (argc > 1 && std::string(argv[1]) == "show") return show();
  ros::init(argc, argv, "lamp");
  ros::NodeHandle node("~");
  dynamic_reconfigure::Server<lamp::LampConfig> server(node);
  server.setCallback(callback);
  std::cout << "ready" << std::endl;
  ros::spin();
}
