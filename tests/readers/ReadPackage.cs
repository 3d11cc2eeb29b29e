// Prints the textures, their texels' digests and the drawings of packages as formats/apps/unity reads them.
using System;
using System.IO;
using System.Security.Cryptography;
using Volpkg;

static class ReadPackage {
  static void Main(string[] names) {
    foreach (var name in names) {
      try {
        Print(new VolumePackage(File.ReadAllBytes(name)));
      } catch (PackageException error) {
        Console.WriteLine("refused " + error.Code);
      }
    }
  }

  static void Print(VolumePackage package) {
    var manifest = package.Manifest;
    Console.WriteLine("package " + manifest.name + " " + manifest.files.Length + " " + manifest.grid.direction[2][0].ToString("r"));
    foreach (var texture in manifest.textures) {
      var texels = package.Texels(texture);
      var digest = SHA256.Create().ComputeHash(texels.Array, texels.Offset, texels.Count);
      var shape = string.Join("x", Array.ConvertAll(texture.shape_zyx, each => each.ToString()));
      Console.WriteLine(texture.name + " " + texture.format + " " + shape + " " + BitConverter.ToString(digest).Replace("-", "").ToLowerInvariant());
    }
    foreach (var picture in manifest.pictures)
      foreach (var drawing in picture.drawings)
        Console.WriteLine(picture.name + " " + drawing.level + " " + string.Join(",", drawing.textures) + " " + (drawing.step_mm ?? 0).ToString("r"));
  }
}
