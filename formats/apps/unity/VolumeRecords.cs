// Records of a manifest, as fields of classes. Null: absent. formats/spec/fields.md describes each field.
// Written by tools/make_cs_schema.py from the models of volprep; do not edit.
namespace Volpkg {
public sealed class AtMesh {
  public string @program;
  public string @mesh;
}
public sealed class Blend {
  public string @order;
  public string[] @colour;
  public string[] @alpha;
}
public sealed class BlockRangesRecord {
  public string @texture;
  public long @level;
  public long @block;
  public long[] @blocks_zyx;
}
public sealed class BrickLayout {
  public long[] @cells_zyx;
  public long @reach;
  public long[] @bricks_zyx;
  public long[] @pool_zyx;
  public long @stored;
}
public sealed class BrickLevel {
  public long[] @factors_zyx;
}
public sealed class Channel {
  public string @name;
  public SourceRecord @source;
  public Statistics @statistics;
  public string @stored_type;
  public Quantization @quantization;
  public Level[] @levels;
  public TransferFunction[] @transfer_functions;
}
public sealed class ClipPlane {
  public double[] @normal;
  public double @constant_mm;
}
public sealed class CompressedForm {
  public string @format;
  public string @channel;
  public bool @kept;
  public long @level;
  public long @size_bytes;
  public string @basis;
  public long @pictures;
  public double? @psnr_db;
  public double @rmse;
  public double @maximum;
}
public sealed class DeviceProfile {
  public string @name;
  public string @api;
  public long @max_texture_size;
  public long @max_3d_texture_size;
  public long @texture_units;
  public string[] @texture_formats;
  public bool @npot = true;
  public bool @square = false;
  public long @index_bits;
  public long @max_texture_bytes;
}
public sealed class DrawCost {
  public long @upload_bytes;
  public long @gpu_bytes;
}
public sealed class Drawing {
  public long @level;
  public long? @frame;
  public string @program;
  public string[] @textures;
  public UniformValue[] @values;
  public double? @step_mm;
  public AtMesh @at_mesh;
  public bool? @preview_only;
  public DrawCost @cost;
  public Fidelity @fidelity;
}
public sealed class Editing {
  public JointHistogram[] @histograms;
}
public sealed class Fidelity {
  public long @pixels;
  public double @pixels_per_voxel;
  public long @views;
  public double @rmse;
  public double @maximum;
  public double @flip;
}
public sealed class FileRecord {
  public string @path;
  public string @role;
  public long @size_bytes;
  public string @sha256;
}
public sealed class FromBricks {
  public string @program;
  public string[] @textures;
  public double @step_mm;
}
public sealed class GapRepair {
  public string @kind = "gaps";
  public string @interpolation = "linear";
  public long @slices_before;
  public long @slices_after;
  public double @usual_gap_mm;
  public double @largest_gap_mm;
}
public sealed class Grid {
  public long[] @shape_zyx;
  public double[] @spacing_mm_zyx;
  public double[] @origin_mm_xyz;
  public double[][] @direction;
  public double[] @extent_mm_zyx;
}
public sealed class GridPoint {
  public string @kind;
  public long[] @subvolumes;
  public string[] @moves;
}
public sealed class Hybrid {
  public long @longest_side = 128;
  public string @opacity = "alpha";
  public ShaderPair @enlarged;
  public ShaderPair @lines;
  public bool @has_lines = true;
}
public sealed class JointHistogram {
  public long @level;
  public string @file;
  public double @reference_mm;
  public string @channel;
}
public sealed class Level {
  public long @index;
  public long[] @factors_zyx;
  public Grid @grid;
  public string @filter;
}
public sealed class LevelTolerance {
  public double @rmse = 0.035;
  public double @flip = 0.1;
  public double @kept_light = 0.5;
}
public sealed class Light {
  public double[] @place_mm_xyz;
  public double @ambient = 0.2;
  public double @diffuse = 0.7;
  public double @specular = 0.3;
  public double @shininess = 20.0;
  public string @shadows = "none";
}
public sealed class LightModel {
  public string @kind;
  public string @channels = "luminance";
  public bool @turnable = false;
  public double[] @sky;
  public double[] @ground;
  public Sun[] @suns;
  public double? @radius_mm;
  public double[] @light_mm;
  public double @ambient = 0.2;
}
public sealed class LightPass {
  public string @vertex;
  public string @fragment;
  public string @geometry;
  public string @sampler;
  public string @target;
  public Uniform[] @uniforms;
  public string[] @reads;
  public long? @size;
  public Blend @blend;
  public Blend @behind;
}
public sealed class Manifest {
  public Texture[] @textures;
  public Palette[] @palettes;
  public Skipping @skipping;
  public Editing @editing;
  public SubvolumeFiles @subvolumes;
  public OnDemand @on_demand;
  public Proxy @proxy;
  public string @preview;
  public string @name;
  public string @generator;
  public DeviceProfile @profile;
  public Grid @grid;
  public SeriesFrame[] @frames;
  public Picture[] @pictures;
  public Segments @segments;
  public CompressedForm[] @compression;
  public RenderSettings @render;
  public PlanItem[] @plan;
  public string @format = "volpkg";
  public string @version = "1.0";
  public string[] @extensions_used;
  public string[] @extensions_required;
  public string @state;
  public Channel[] @channels;
  public Program[] @programs;
  public object[] @stages;
  public FileRecord[] @files;
}
public sealed class MosaicLayout {
  public long[] @tile_shape_yx;
  public long @slices;
  public long @components_per_voxel = 1;
  public long @slices_per_texel;
  public string @order = "interleaved";
  public long @gutter = 0;
  public long[] @padding_yx;
  public long @tiles_x;
  public long @tiles_y;
  public long @textures = 1;
  public long[] @texture_shape_yx;
}
public sealed class Normals {
  public string @code;
  public string @kernel;
}
public sealed class OnDemand {
  public string @index;
  public string @bricks;
  public long @size;
  public long @ghost;
  public BrickLevel[] @levels;
  public string @format;
  public long[] @places_zyx;
}
public sealed class OtherRepair {
  public string @kind;
  public string @interpolation = "";
}
public sealed class Palette {
  public string @transfer;
  public PaletteEntry[] @entries;
}
public sealed class PaletteEntry {
  public double[] @colour;
  public double @extinction_per_mm;
}
public sealed class Pass {
  public string @vertex;
  public string @fragment;
  public string @geometry;
  public string @sampler;
  public string @target;
  public Uniform[] @uniforms;
  public string[] @reads;
  public long? @size;
}
public sealed class Picture {
  public string @name;
  public PictureMedium[] @media;
  public string @mixing = "one";
  public Grid @grid;
  public Drawing[] @drawings;
  public Pieces @pieces;
  public FromBricks @on_demand;
}
public sealed class PictureMedium {
  public string @channel;
  public string @transfer;
  public double[] @placed;
  public bool? @unlit;
}
public sealed class Pieces {
  public string @program;
  public string[] @textures;
  public double @step_mm;
}
public sealed class PlanItem {
  public string @name;
  public string @kind = "";
  public string @channel;
  public string @transfer;
  public long? @level;
  public bool @kept;
  public string @reason;
  public string[] @files;
  public long @size_bytes = 0;
}
public sealed class Program {
  public string @name;
  public string @sampling;
  public string @technique = "ray-casting";
  public string @classification = "lookup";
  public string @lighting = "none";
  public string @normals_from = "volume";
  public Light @light;
  public bool @baked = false;
  public string @compositing = "emission-absorption";
  public string @rays = "box";
  public string @vertex;
  public string @fragment;
  public Uniform[] @uniforms;
  public string[] @samplers;
  public string @geometry = "triangle";
  public Pass[] @before;
  public LightPass @light_pass;
  public Tiles @tiles;
  public Blend @blend;
  public string @target = "rgba8";
  public long? @slab_samples;
  public double? @step_mm_min;
  public double? @opacity_cutoff;
}
public sealed class Proxy {
  public double @epsilon = 0.0;
  public ProxyMeshFile[] @meshes;
}
public sealed class ProxyMeshFile {
  public string @name;
  public string @transfer;
  public long @level;
  public string @form;
  public long @block;
  public string @file;
  public long @vertices = 0;
  public long @triangles = 0;
  public bool @draco = false;
  public double[] @box_from_mesh_mm_xyz;
  public double @occupied_share;
}
public sealed class Quantization {
  public long @bits;
  public double[] @window;
  public double @slope;
  public double @intercept;
  public double @rmse;
  public double @max_error;
  public long @clipped_below;
  public long @clipped_above;
}
public sealed class RenderSettings {
  public string @projection = "orthographic";
  public Tolerance @tolerance;
  public Hybrid @hybrid;
}
public sealed class Segment {
  public string @name;
  public string @title;
  public SegmentCode @code;
  public long @number;
  public string @transfer;
  public double[] @tint;
  public double @opacity = 1.0;
  public bool @visible = true;
  public double @volume_ml;
}
public sealed class SegmentCode {
  public string @scheme;
  public string @value;
  public string @meaning;
}
public sealed class SegmentLabel {
  public string[] @segments;
  public string @transfer;
}
public sealed class Segments {
  public string @name = "segments";
  public string[] @transfers;
  public string @border = "mixed";
  public Segment[] @segments;
  public SegmentLabel[] @labels;
  public double @outside = 1.0;
  public string @sha256;
}
public sealed class SeriesFrame {
  public double? @time_s;
}
public sealed class ShaderPair {
  public string @vertex;
  public string @fragment;
}
public sealed class SkipTable {
  public string @texture;
  public long @level;
  public string @transfer;
  public string @kind;
  public long @block;
  public long[] @blocks_zyx;
  public double @empty_share;
}
public sealed class Skipping {
  public double @epsilon = 0.0;
  public SkipTable[] @tables;
  public BlockRangesRecord[] @ranges;
}
public sealed class SliceLayout {
  public string @axis;
  public long[] @slice_shape_yx;
  public long @first;
  public long @slices;
  public long @tiles_x;
  public double @largest_opacity = 1.0;
  public long @layers = 1;
}
public sealed class SourceInfo {
  public string @format;
  public Grid @grid;
  public string @stored_type;
  public double @slope = 1.0;
  public double @intercept = 0.0;
  public string @unit = "";
  public string @modality = "";
  public bool @level_set = false;
  public long[] @label_numbers;
  public object[] @repairs;
  public string[] @remarks;
}
public sealed class SourceRecord {
  public SourceInfo @info;
  public string @sha256;
}
public sealed class Statistics {
  public double @minimum;
  public double @maximum;
  public long @non_finite;
}
public sealed class StoredLight {
  public LightModel @model;
  public double[] @texture_from_box_per_mm_xyz;
  public double @largest;
  public double @subtracted = 0.0;
  public double[] @first_colour;
  public double[] @stored_values;
  public ClipPlane[] @planes;
  public long @samples;
  public double @residual;
}
public sealed class Subvolume {
  public long @minimum;
  public long @maximum;
  public string @file;
  public long? @label;
}
public sealed class SubvolumeFiles {
  public string @grid;
  public string[] @pieces;
  public string @whole;
}
public sealed class SubvolumeGrid {
  public string @format = "volpkg-subvolumes";
  public long[] @shape_zyx;
  public long @size;
  public long[][] @cuts_zyx;
  public long? @ghost;
  public string @texture_format;
  public string @dimension;
  public string @filter = "linear";
  public MosaicLayout @mosaic;
  public string @whole;
  public Subvolume[] @subvolumes;
  public GridPoint[] @points;
  public ViewThresholds @view;
}
public sealed class Sun {
  public double[] @direction;
  public double[] @colour;
  public double @size_degrees = 5.0;
}
public sealed class Texture {
  public long[] @shape_zyx;
  public long? @level;
  public string[] @channels;
  public MosaicLayout @mosaic;
  public long? @mipmap;
  public string @transfer;
  public double? @reference_mm;
  public string @filter = "linear";
  public string @name;
  public string @role;
  public string @file;
  public string @format;
  public string @dimension;
  public BrickLayout @bricks;
  public long @part = 0;
  public double? @max_extinction_per_mm;
  public double[] @stored_range;
  public Normals @normals;
  public StoredLight @light;
  public string @encoder;
  public SliceLayout @slices;
}
public sealed class Tiles {
  public long @size;
  public long @groups;
  public string @cost;
  public string @offsets;
  public string @place;
  public Uniform[] @uniforms;
  public string[] @reads;
}
public sealed class TiltRepair {
  public string @kind = "tilt";
  public string @interpolation = "linear";
  public double @about_rows_deg;
  public double @about_columns_deg;
  public long @added_rows;
  public long @added_columns;
  public double @padding;
}
public sealed class Tolerance {
  public double @rmse = 0.01;
  public double @maximum = 0.25;
  public double @flip = 0.03;
  public double @kept_light = 0.75;
  public LevelTolerance @levels;
}
public sealed class TransferFunction {
  public string @name;
  public TransferPoint[] @points;
  public double @reference_mm = 1.0;
  public double? @isovalue;
  public double[] @intensities;
}
public sealed class TransferPoint {
  public double @value;
  public double[] @colour;
  public double @extinction_per_mm;
}
public sealed class Uniform {
  public string @name;
  public string @type;
  public string @source;
}
public sealed class UniformValue {
  public string @source;
  public double[] @numbers;
}
public sealed class ViewThresholds {
  public double @plus_z_below_theta = 67.5;
  public double @minus_z_above_theta = 112.5;
  public double[] @sideways_between_theta;
  public double @plus_x_below_phi = 67.5;
  public double @minus_x_above_phi = 112.5;
  public double[] @y_between_phi;
  public double @finer_above_pixels = 2.0;
  public double @coarser_below_pixels = 0.75;
}
}
