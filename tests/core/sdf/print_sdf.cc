// Prints the SDF to which sdformat converts a file, for make_recorded.py. Debian 12: libsdformat-dev.
// g++ -std=c++17 print_sdf.cc -o print_sdf $(pkg-config --cflags --libs sdformat12)
#include <fstream>
#include <iostream>
#include <sdf/sdf.hh>
#include <sstream>

int main(int, char **argv) {
  sdf::setFindCallback([](const std::string &file) { return file; });
  sdf::SDFPtr document(new sdf::SDF());
  sdf::init(document);
  std::stringstream text;
  text << std::ifstream(argv[1]).rdbuf();
  sdf::Errors errors;
  if (!sdf::readString(text.str(), document, errors)) return 1;
  std::cout << document->ToString() << std::endl;
}
