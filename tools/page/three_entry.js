// What the page takes of three: tools/vendor_page.py makes one file of it, without the rest.
export {
  AmbientLight, BoxGeometry, BufferAttribute, BufferGeometry, Color, ColorManagement, ConeGeometry, CylinderGeometry, DataTexture, DirectionalLight,
  DoubleSide, Group, InstancedBufferAttribute, InstancedMesh, LinearSRGBColorSpace, LineBasicMaterial, LineSegments, LoadingManager, Matrix4, Mesh,
  MeshBasicMaterial, MeshLambertMaterial, NearestFilter, OrthographicCamera, PerspectiveCamera, PlaneGeometry, Points, Quaternion, Raycaster, RedFormat, RGBAFormat,
  Scene, ShaderMaterial, SphereGeometry, UnsignedByteType, Vector2, Vector3, WebGLRenderer } from "three";
export { LineMaterial } from "three/addons/lines/LineMaterial.js";
export { LineSegments2 } from "three/addons/lines/LineSegments2.js";
export { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
export { ColladaLoader } from "three/addons/loaders/ColladaLoader.js";
export { STLLoader } from "three/addons/loaders/STLLoader.js";
